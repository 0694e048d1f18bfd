#include "host/doctor/examination.hpp"

#include "host/doctor/appliance.hpp"
#include "host/doctor/cameras.hpp"
#include "host/doctor/computer.hpp"
#include "host/doctor/display.hpp"
#include "host/doctor/inputs.hpp"
#include "host/doctor/lines.hpp"
#include "host/doctor/service.hpp"

namespace birdseye::host {

std::vector<Question> questions_of(const Machine& machine, const Examination& examination) {
  std::vector<Question> all;
  const auto add = [&all](const std::vector<Question>& some) { all.insert(all.end(), some.begin(), some.end()); };
  if (!examination.server.empty()) add({appliance_question(examination.server)});
  if (!examination.ct.path.empty()) add({ct_question(examination.ct)});
  if (!examination.record.empty()) add({record_question(examination.record)});
  add(line_questions(machine));
  add(camera_questions(machine));
  add(pin_questions(machine));
  add(service_questions(machine, examination.config));
  add(computer_questions(machine, examination.results));
  add(window_questions(machine));
  return all;
}

}  // namespace birdseye::host
