#include "host/files/authors.hpp"

#include <fmt/format.h>

#include <utility>

namespace birdseye::host {

namespace {

constexpr const char* kAccept = "--accept-unsigned uses it all the same";

}  // namespace

Result<Authors> Authors::of_this_machine(bool accept_unsigned) {
  auto machine = ThisMachine::open();
  if (!machine) return machine.error();
  return Authors{std::make_shared<const ThisMachine>(*std::move(machine)), accept_unsigned};
}

Result<std::string> Authors::admit(std::string_view kind, std::string_view sha256,
                                   const std::optional<calibration::FileSignature>& signature) const {
  const auto author = machine->author_of(kind, sha256, signature);
  if (!author) return author.error();
  if (author->standing == Author::Standing::known) return std::string();
  std::string words = author->words();
  if (accept_unsigned) return words;
  if (author->standing == Author::Standing::nobody)
    return Error{Errc::bad_value, fmt::format("is {}; {}", words, kAccept)};
  return Error{Errc::bad_value,
               fmt::format("is {}; if it is yours, birdseye verify --trust NAME makes it known by this file; {}", words,
                           kAccept)};
}

Result<std::string> Authors::admit_resting_on(const std::string& doubt) const {
  if (doubt.empty() || accept_unsigned) return doubt;
  return Error{Errc::bad_value, fmt::format("rests on what no known machine signed ({}); {}", doubt, kAccept)};
}

Result<std::string> Authors::admit_with_rest(std::string_view kind, std::string_view sha256,
                                             const std::optional<calibration::FileSignature>& signature,
                                             const std::string& rests_on) const {
  auto doubt = admit(kind, sha256, signature);
  if (!doubt || !doubt->empty() || rests_on.empty()) return doubt;
  if (auto rest = admit_resting_on(rests_on); !rest) return rest;
  return fmt::format("made of what no known machine signed ({})", rests_on);
}

Result<void> note_author(const std::string& path, std::string_view kind, std::string_view sha256,
                         const std::optional<calibration::FileSignature>& signature) {
  const auto authors = Authors::of_this_machine(true);
  if (!authors) {  // without a key of its own a machine knows nobody
    fmt::print(stderr, "birdseye: {}: whose it is cannot be told: {}\n", path, authors.error().what);
    return {};
  }
  const auto doubt = authors->admit(kind, sha256, signature);
  if (!doubt) return doubt.error().with_context(path);
  if (!doubt->empty()) fmt::print(stderr, "birdseye: {}: {}\n", path, *doubt);
  return {};
}

void note_resting_on(const std::string& path, const std::string& doubt) {
  if (!doubt.empty()) fmt::print(stderr, "birdseye: {}: rests on what no known machine signed ({})\n", path, doubt);
}

}  // namespace birdseye::host
