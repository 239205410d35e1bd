// SPDX-License-Identifier: MIT
//
// Any octets: the decoder refuses them with an error that makes sense, or reads a management
// message that it reads again from what the encoder wrote; the responder answers with well-formed
// messages only, and never an answer with an answer.
#include <cstddef>
#include <cstdint>
#include <span>

#include "ftcs/ptp/management_responder.h"
#include "test/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ftcs::ptp;
  using ftcs::fuzz::require;
  const std::span<const std::uint8_t> octets(data, size);
  const auto message = decode_management(octets);
  ManagementResponder responder;
  const auto answer = responder.answer(octets, ManagedPort{});
  if (!message) {
    require(message.error().offset <= size, "an error lies inside the message");
    require(message.error().expected != message.error().received, "expected and received differ");
    require(!answer, "nothing is said to what is not understood");
    return 0;
  }
  auto plain = *message;
  plain.header.correction = {};  // not sent in management messages
  const auto again = decode_management(encode_management(plain).view());
  require(again.ok(), "what was written can be read");
  require(*again == plain, "nothing is lost");
  if (answer) {
    require(message->action() != ManagementAction::kResponse, "a request was answered");
    const auto decoded = decode_management(answer->view());
    require(decoded.ok(), "the answer can be read");
    require(!responder.answer(answer->view(), ManagedPort{}), "an answer is not answered");
  }
  return 0;
}
