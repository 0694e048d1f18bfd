#include "host/volume/decoder_process.hpp"

#include <errno.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "host/confine/isolated.hpp"
#include "host/volume/import.hpp"
#include "tests/support/refused_calls.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Scratch;
using ::testing::StartsWith;

/// What is said of a file whose decoder does this once it has named the file.
Error error_of(const fs::path& file, const std::function<void()>& work) {
  const auto decode = [&](const Announce& announce, std::span<ProcessCopy>) -> Result<SendDecoded> {
    announce(file);
    work();
    return SendDecoded([](const Send&) {});
  };
  const auto ran = run_decoder(file.parent_path(), {}, decode, [](const Receive&) { return true; });
  return ran ? Error{Errc::bad_value, "it was done"} : ran.error();
}

TEST(DecoderProcess, WhatTakesLongerThanItsSizeJustifiesIsNotCalledDamaged) {
  const Scratch scratch;
  const fs::path file = scratch.file("slice.dcm", "x");
  const Error late = error_of(file, [] {
    for (volatile unsigned i = 0;;) i = i + 1;
  });
  EXPECT_EQ(late.code, Errc::unsupported);
  EXPECT_THAT(late.what, StartsWith(file.string() + ": its decoder took longer than a file of its size justifies: "));
  EXPECT_THAT(late.what, HasSubstr("; save it uncompressed"));
  EXPECT_THAT(late.what, Not(HasSubstr("damaged")));
}

TEST(DecoderProcess, WhatEndsItsDecoderIsCalledDamaged) {
  const Scratch scratch;
  const fs::path file = scratch.file("slice.dcm", "x");
  const Error ended = error_of(file, [] { std::abort(); });
  EXPECT_EQ(ended.code, Errc::bad_format);
  EXPECT_THAT(ended.what, StartsWith(file.string() + ": is cut short, damaged, or too large to decode (its decoder "));
  EXPECT_THAT(ended.what, HasSubstr("signal 6"));
}

TEST(DecoderProcess, NothingIsReadWhereItCannotBeConfined) {
  if (::prctl(PR_GET_SECCOMP) < 0) GTEST_SKIP() << "this kernel has no seccomp filters";
  const Scratch scratch;
  const std::string path = scratch.file("ct.mha", "no image");
  std::string came(1000, ' ');
  const auto ran = run_isolated(
      [&](const Send& send) {
        if (!testing::refuse_calls({{SYS_seccomp}, {SYS_prctl, 0, PR_SET_SECCOMP}}, EINVAL)) return;
        const auto read = import_volume(path);
        std::string said = read ? "it was read" : read.error().what;
        said.resize(came.size(), ' ');
        send(said.data(), said.size());
      },
      [&](const Receive& receive) { (void)receive(came.data(), came.size()); }, Duration::from_ms(60'000));
  ASSERT_TRUE(ran) << ran.error().what;
  EXPECT_THAT(came, StartsWith(path + ": its decoder cannot be confined: there is no filter of its system calls"));
}

}  // namespace
}  // namespace birdseye::host
