// A sealed text: what was sealed comes out, and not one bit of it may be changed.

#include "host/files/sealed_text.hpp"

#include <nlohmann/json.hpp>

#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string input = testing::as_text({data, size});
  (void)host::unseal(input);
  const auto json = nlohmann::json::parse(input, nullptr, false);
  if (!json.is_object()) return 0;
  std::vector<host::SealedPart> parts;
  nlohmann::json sealed = nlohmann::json::object();
  for (const auto& [name, value] : json.items()) {
    const bool word = std::all_of(name.begin(), name.end(), [](char c) { return c >= 'a' && c <= 'z'; });
    if (!word || name.empty() || name == "whole" || name == "signed") continue;
    parts.emplace_back(name, value);
    sealed[name] = value;
  }
  std::string text = host::sealed_text(parts);
  const auto read = host::unseal(text);
  testing::must(read && *read == sealed, "what was sealed comes out");
  char& changed = text[size * 7919 % text.size()];
  changed = static_cast<char>(changed ^ (1 << size % 8));
  testing::must(!host::unseal(text), "a bit that was changed is seen");
  return 0;
}
