#pragma once

#include <gtest/gtest.h>
#include <xcb/xcb.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace birdseye::testing {

/// What is on a display, as whoever sits before it sees it: by the X server, not by the program that draws there.
class Screen {
 public:
  explicit Screen(const std::string& display) : server_(xcb_connect(display.c_str(), nullptr)) {
    EXPECT_EQ(xcb_connection_has_error(server_), 0) << display;
  }
  ~Screen() { xcb_disconnect(server_); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Presses a key of the topmost window and lets go of it, faster than any hand. code: the server's, 65 is the
  /// space bar of its usual keyboard.
  void tap(std::uint8_t code) {
    const xcb_window_t root = xcb_setup_roots_iterator(xcb_get_setup(server_)).data->root;
    const std::unique_ptr<xcb_query_tree_reply_t, decltype(&std::free)> tree(
        xcb_query_tree_reply(server_, xcb_query_tree(server_, root), nullptr), &std::free);
    ASSERT_TRUE(tree);
    const int windows = xcb_query_tree_children_length(tree.get());
    ASSERT_GT(windows, 0);
    xcb_key_press_event_t event{};
    event.detail = code;
    event.root = root;
    event.event = xcb_query_tree_children(tree.get())[windows - 1];
    event.same_screen = 1;
    for (const int type : {XCB_KEY_PRESS, XCB_KEY_RELEASE}) {
      event.response_type = static_cast<std::uint8_t>(type);
      event.time += 1000;
      xcb_send_event(server_, 0, event.event, XCB_EVENT_MASK_NO_EVENT, reinterpret_cast<const char*>(&event));
    }
    // An answer comes when all before it is done.
    std::free(xcb_get_input_focus_reply(server_, xcb_get_input_focus(server_), nullptr));
  }

  /// RGB, rows from the top; all of it of one moment. Empty where there is no such display.
  [[nodiscard]] std::vector<std::uint8_t> grab(int left_px, int top_px, int width_px, int height_px) {
    std::vector<std::uint8_t> rgb;
    if (xcb_connection_has_error(server_) != 0) return rgb;
    const xcb_window_t root = xcb_setup_roots_iterator(xcb_get_setup(server_)).data->root;
    const auto asked = xcb_get_image(server_, XCB_IMAGE_FORMAT_Z_PIXMAP, root, static_cast<std::int16_t>(left_px),
                                     static_cast<std::int16_t>(top_px), static_cast<std::uint16_t>(width_px),
                                     static_cast<std::uint16_t>(height_px), ~0U);
    const std::unique_ptr<xcb_get_image_reply_t, decltype(&std::free)> got(xcb_get_image_reply(server_, asked, nullptr),
                                                                           &std::free);
    const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
    if (!got || static_cast<std::size_t>(xcb_get_image_data_length(got.get())) != 4 * pixels) return rgb;
    rgb.resize(3 * pixels);
    const std::uint8_t* const bgrx = xcb_get_image_data(got.get());
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < 3; ++c) rgb[3 * i + c] = bgrx[4 * i + 2 - c];
    }
    return rgb;
  }

 private:
  xcb_connection_t* server_;
};

}  // namespace birdseye::testing
