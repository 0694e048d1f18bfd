// A registration case, as far as it is read before its files are, which other programs' formats are.

#include "host/case/registration_case.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string text = testing::as_text({data, size});
  // A path that leads to a file of this machine would be read: the case's folder has none but the case.
  if (text.find('/') != std::string::npos || text.find("..") != std::string::npos) return 0;
  const std::string path = testing::as_file("case.toml", text);
  const auto read = host::read_case(path);
  testing::must(!read, "a case without a CT is refused");
  testing::must_name(read.error().what, path);
  return 0;
}
