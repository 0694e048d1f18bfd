// What a unit, or something else at its line, answers when it is asked what it is.

#include "drivers/minibird/unit_info.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace birdseye;
using namespace birdseye::drivers;

/// Whoever it is sends the input, and then hangs up.
class Line final : public ByteStream {
 public:
  explicit Line(testing::ByteView input) : input_(input) {}
  Result<std::size_t> read(std::span<std::uint8_t> into, Deadline /*deadline*/) override {
    if (input_.empty()) return Error{Errc::disconnected, "gone"};
    const auto bytes = input_.take(into.size());
    std::copy(bytes.begin(), bytes.end(), into.begin());
    return bytes.size();
  }
  Result<void> write(std::span<const std::uint8_t> /*bytes*/, Deadline /*deadline*/) override { return {}; }
  void discard_input() override {}
  bool set_rts(bool /*asserted*/) override { return false; }
  [[nodiscard]] const std::string& name() const override { return name_; }

 private:
  testing::Pieces input_;
  std::string name_ = "line";
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Line line({data, size});
  minibird::Dialogue dialogue(line, Duration::from_ms(1000), Duration::from_ms(100));
  const auto info = minibird::examine_unit(dialogue, 0);
  if (!info) return 0;
  testing::must(std::all_of(info->model.begin(), info->model.end(), [](char c) { return c >= ' ' && c <= '~'; }),
                "a model can be shown");
  testing::must(info->revision_major >= 1 && info->revision_major <= 9, "a revision is one");
  if (const auto errors = minibird::read_errors(dialogue, 0)) (void)minibird::words_of(*errors);
  return 0;
}
