// SPDX-License-Identifier: MIT
#include "test/support/forbid_allocation.h"

#include <cstdio>
#include <cstdlib>
#include <new>

namespace {
thread_local int forbidden_depth = 0;

void* allocate(std::size_t size) {
  if (forbidden_depth > 0) {
    std::fputs("allocation where none is allowed\n", stderr);
    std::abort();
  }
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) std::abort();
  return memory;
}
}  // namespace

namespace ftcs::test {
ForbidAllocation::ForbidAllocation() noexcept { ++forbidden_depth; }
ForbidAllocation::~ForbidAllocation() { --forbidden_depth; }
}  // namespace ftcs::test

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
