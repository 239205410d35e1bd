// SPDX-License-Identifier: MIT
//
// Any octets: the decoder refuses them with an error that makes sense, or reads a management
// message that it reads again from what the encoder wrote; the responder answers who asked, with
// well-formed messages that hold what was asked for, and never an answer with an answer.
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "ftcs/ptp/management_responder.h"
#include "test/fuzz/require.h"

namespace ftcs::ptp {
namespace {
using fuzz::require;

/// Every field at an end of its range: the longest texts, times that no TimeInterval holds.
ManagedPort extreme_port() {
  const std::string text(200, 'x');
  ManagedPort port;
  port.identity = {ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};
  port.domain = 255;
  port.major_sdo_id = 15;
  port.description.physical_layer = PtpText<32>(text);
  port.description.physical_address.size = 16;
  port.description.protocol_address.size = 16;
  port.description.product = PtpText<64>(text);
  port.description.revision = PtpText<32>(text);
  port.description.user = PtpText<128>(text);
  port.user.text = PtpText<128>(text);
  port.current.steps_removed = 0xFFFF;
  port.current.offset = Duration::from_whole_ns(std::numeric_limits<std::int64_t>::min());
  port.current.mean_path_delay = Duration::from_whole_ns(std::numeric_limits<std::int64_t>::max());
  port.port.mean_link_delay = port.current.mean_path_delay;
  port.time_status.offset_ns = std::numeric_limits<std::int64_t>::min();
  port.properties.interface = PtpText<32>(text);
  port.stats.received.fill(std::numeric_limits<std::uint64_t>::max());
  return port;
}

void check_answer(const ManagementMessage& request, std::span<const std::uint8_t> octets,
                  const ManagedPort& port) {
  ManagementResponder responder;
  const auto answer = responder.answer(octets, port);
  const ManagementCounters& counters = responder.counters();
  require(counters.malformed == 0, "what can be decoded is not malformed");
  require(counters.answered + counters.refused + counters.ignored == 1, "each is counted once");
  require(answer.has_value() == (counters.ignored == 0), "what is not ignored is answered");
  if (!answer) return;
  require(request.action() != ManagementAction::kResponse, "a request was answered");
  const auto decoded = decode_management(answer->view());
  require(decoded.ok(), "the answer can be read");
  require(decoded->header.source.clock == port.identity.clock, "it comes from us");
  require(decoded->body.target == request.header.source, "it goes to who asked");
  require(decoded->header.sequence_id == request.header.sequence_id, "it is this request's");
  require(decoded->id == request.id, "it is about what was asked");
  require(decoded->error.has_value() == (counters.refused == 1), "a refusal is one");
  require(decoded->error || request.action() != ManagementAction::kGet || decoded->data.has_value(),
          "it holds what was asked for");
  require(!responder.answer(answer->view(), port), "an answer is not answered");
}

}  // namespace
}  // namespace ftcs::ptp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ftcs::ptp;
  const std::span<const std::uint8_t> octets(data, size);
  const auto message = decode_management(octets);
  if (!message) {
    require(message.error().offset <= size, "an error lies inside the message");
    require(message.error().expected != message.error().received, "expected and received differ");
    ManagementResponder responder;
    require(!responder.answer(octets, ManagedPort{}), "what is not understood is not answered");
    require(responder.counters().malformed == 1, "and counted");
    return 0;
  }
  auto plain = *message;
  plain.header.correction = {};  // not sent in management messages
  const auto again = decode_management(encode_management(plain).view());
  require(again.ok(), "what was written can be read");
  require(*again == plain, "nothing is lost");
  static const ManagedPort kExtreme = extreme_port();
  check_answer(*message, octets, ManagedPort{});
  check_answer(*message, octets, kExtreme);
  // As if it were for us, wherever it came from.
  ManagementMessage ours = plain;
  ours.header.domain = kExtreme.domain;
  ours.header.major_sdo_id = kExtreme.major_sdo_id;
  ours.body.target.clock = kExtreme.identity.clock;
  const ManagementBytes bytes = encode_management(ours);
  check_answer(*decode_management(bytes.view()), bytes.view(), kExtreme);
  return 0;
}
