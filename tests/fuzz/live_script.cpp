// A script of keys and pictures for the live window, and some hours of it in which nothing that it waits for comes.

#include "host/window/live_script.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  constexpr Duration kEach = Duration::from_ms(100'000);
  const std::string path = testing::as_file("live.txt", testing::as_text({data, size}));
  auto script = host::LiveScript::read(path);
  if (!script) {
    testing::must_name(script.error().what, path);
    return 0;
  }
  const host::OperationView operation{};
  HostTime now{1'000'000'000};
  for (int i = 0; i < 200; ++i) {
    now = now + kEach;
    const auto act = script->next(operation, now);
    if (!act) {
      testing::must_name(act.error().what, path);
      break;
    }
    testing::must(!act->place_mm || act->place_mm->allFinite(), "a place is finite");
    if (act->end) break;
  }
  return 0;
}
