#include "host/doctor/question.hpp"

#include <fmt/format.h>

#include <exception>

#include "drivers/system/thread.hpp"

namespace birdseye::host {

std::vector<Check> ask_all(const std::vector<Question>& questions, const std::function<void(const Check&)>& told) {
  std::vector<Check> all;
  for (const Question& question : questions) {
    const auto unknown = [area = question.area, name = question.name](const std::string& why, const char* remedy) {
      return std::vector<Check>{{area, name, CheckState::not_known, why, remedy}};
    };
    const auto given = given_by<std::vector<Check>>(Deadline::after(question.within), [ask = question.ask, unknown] {
      try {
        return ask();
      } catch (const std::exception& error) {
        return unknown(error.what(), "");
      }
    });
    const auto late = [&] {
      return unknown(
          fmt::format("no answer within {:g} s", question.within.seconds()),
          "what it asks hangs: unplug a device and plug it in again; of a file or a server, see the network");
    };
    for (const Check& check : given ? *given : late()) {
      if (told) told(check);
      all.push_back(check);
    }
  }
  return all;
}

}  // namespace birdseye::host
