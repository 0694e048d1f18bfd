#include "host/doctor/cameras.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/gpio/gpio_chip.hpp"
#include "drivers/video/v4l2_device.hpp"

namespace birdseye::host {

namespace {

constexpr const char* kCameras = "cameras";
constexpr const char* kPins = "pins";

std::vector<std::string> nodes_named(const Machine& machine, const std::string& begin) {
  std::vector<std::string> nodes;
  for (const std::string& name : names_in(machine.at("/dev"))) {
    const bool numbered =
        name.size() > begin.size() && name.find_first_not_of("0123456789", begin.size()) == std::string::npos;
    if (name.starts_with(begin) && numbered) nodes.push_back("/dev/" + name);
  }
  return nodes;
}

/// "MJPG and YUYV, up to 1920x1080"; empty where nothing is offered that is read here.
std::string offer_words(const std::vector<drivers::FormatOffer>& offers) {
  std::string formats;
  int wide_px = 0, high_px = 0;
  for (const drivers::FormatOffer& offer : offers) {
    if (!drivers::pixel_format_of_fourcc(offer.fourcc)) continue;
    formats += fmt::format("{}{}", formats.empty() ? "" : " and ", drivers::fourcc_name(offer.fourcc));
    for (const drivers::SizeOffer& size : offer.sizes) {
      if (size.most_width_px <= wide_px) continue;
      wide_px = size.most_width_px;
      high_px = size.most_height_px;
    }
  }
  if (wide_px > 0) formats += fmt::format(", up to {}x{}", wide_px, high_px);
  return formats;
}

/// A webcam has a second node, for what it says beside the pictures.
bool is_second_node(const Machine& machine, const std::string& node) {
  const std::string index = first_line(machine.at("/sys/class/video4linux/" + node.substr(5) + "/index"));
  return !index.empty() && index != "0";
}

std::vector<Check> check_camera(const Machine& machine, const std::string& node) {
  Check check{kCameras, node, CheckState::good, "", ""};
  if (const auto refused = refusal(machine, node)) {
    check.state = CheckState::bad;
    check.found = refused->found;
    check.remedy = refused->remedy;
    return {check};
  }
  const auto device = drivers::V4l2Device::open(machine.at(node).string());
  if (!device && device.error().code == Errc::unsupported && is_second_node(machine, node)) return {};
  if (!device) {
    check.state = CheckState::bad;
    check.found = device.error().what;
    check.remedy = "name another node in [camera] source; a loopback device streams while a program writes into it";
    return {check};
  }
  const Holders holders = holders_of(machine, node);
  const std::string offers = offer_words(device->offers({}));
  check.found = fmt::format("{} ({}); {}", device->card(), device->driver(),
                            offers.empty() ? "no format that is read here" : offers);
  if (offers.empty()) {
    check.state = CheckState::bad;
    check.remedy = "take a camera that gives RGB3, BGR3, YUYV, UYVY, NV12, MJPG or GREY";
  } else if (!holders.programs.empty()) {
    check.state = CheckState::could_be_better;
    check.found += fmt::format("; held by {}", fmt::join(holders.programs, ", "));
    check.remedy = "if birdseyed is to have it and this is another program, stop that one";
  } else if (!holders.all_seen) {
    check.found += "; whether a program of another user holds it is not known";
  }
  return {check};
}

std::vector<Check> check_chip(const Machine& machine, const std::string& node) {
  Check check{kPins, node, CheckState::good, "", ""};
  if (const auto refused = refusal(machine, node)) {
    // A host needs no pins: whoever does is told by birdseyed.
    check.state = CheckState::could_be_better;
    check.found = refused->found;
    check.remedy = "only if strobe, pedal, LED or trigger are on it: " + refused->remedy;
    return {check};
  }
  const auto words = drivers::describe_gpio_chip(machine.at(node).string());
  check.found = words ? *words : words.error().what;
  if (!words) check.state = CheckState::bad;
  if (!words) check.remedy = "name another chip in [gpio] chip; gpiodetect lists them";
  return {check};
}

}  // namespace

std::vector<std::string> camera_nodes(const Machine& machine) {
  return nodes_named(machine, "video");
}

std::vector<Question> camera_questions(const Machine& machine) {
  std::vector<Question> questions;
  for (const std::string& node : camera_nodes(machine))
    questions.push_back(
        {.area = kCameras, .name = node, .ask = [machine, node] { return check_camera(machine, node); }});
  if (!questions.empty()) return questions;
  return {{.area = kCameras, .name = "cameras", .ask = [] {
             return std::vector<Check>{
                 {kCameras, "cameras", CheckState::missing, "no Video4Linux camera",
                  "plug in the camera or grabber; where an appliance has it, give --server HOST:PORT"}};
           }}};
}

std::vector<Question> pin_questions(const Machine& machine) {
  std::vector<Question> questions;
  for (const std::string& node : nodes_named(machine, "gpiochip"))
    questions.push_back({.area = kPins, .name = node, .ask = [machine, node] { return check_chip(machine, node); }});
  if (!questions.empty()) return questions;
  return {{.area = kPins, .name = "pins", .ask = [] {
             return std::vector<Check>{{kPins, "pins", CheckState::missing,
                                        "no GPIO chip; only strobe, pedal, LED and trigger need one", ""}};
           }}};
}

}  // namespace birdseye::host
