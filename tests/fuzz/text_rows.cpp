// A table of text, as programs of all kinds write one.

#include "host/files/text_rows.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  auto rows = host::TextRows::open(testing::as_file("input.csv", testing::as_text({data, size})));
  if (!rows) return 0;
  std::size_t line = 0;
  while (const auto row = rows->next()) {
    testing::must(row->line > line, "lines are in their order");
    line = row->line;
    testing::must(!row->fields.empty(), "a row has a field");
    for (const std::string& field : row->fields) {
      testing::must(field.find('\n') == std::string::npos, "a field is of one line");
      testing::must(field.empty() || (field.front() != ' ' && field.back() != ' '), "a field has no blanks about it");
    }
  }
  return 0;
}
