#pragma once

#include <stdlib.h>

#include <optional>
#include <string>

namespace birdseye::hw_sim {

/// A variable of the environment for a while.
class SetVariable {
 public:
  SetVariable(const char* name, const std::string& value) : name_(name) {
    if (const char* const former = ::getenv(name); former != nullptr) former_ = former;
    ::setenv(name, value.c_str(), 1);
  }
  ~SetVariable() { former_ ? ::setenv(name_, former_->c_str(), 1) : ::unsetenv(name_); }
  SetVariable(const SetVariable&) = delete;
  SetVariable& operator=(const SetVariable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> former_;
};

}  // namespace birdseye::hw_sim
