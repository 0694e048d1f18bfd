#include "host/window/stall_cover.hpp"

#include <xcb/xcb.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <span>
#include <vector>

namespace birdseye::host {

namespace {

template <typename T>
using Reply = std::unique_ptr<T, decltype(&std::free)>;

/// Four bytes a pixel, as all servers of today have it for 24 and 32 bits of depth.
std::vector<std::uint8_t> bgrx_of(std::span<const std::uint8_t> rgb) {
  std::vector<std::uint8_t> out;
  out.reserve(rgb.size() / 3 * 4);
  for (std::size_t i = 0; i + 2 < rgb.size(); i += 3) out.insert(out.end(), {rgb[i + 2], rgb[i + 1], rgb[i], 255});
  return out;
}

/// A few rows at a time: a request of the protocol's has a bound.
void put_picture(xcb_connection_t* server, xcb_pixmap_t pixmap, std::uint8_t depth,
                 const std::vector<std::uint8_t>& bgrx, int width_px, int height_px) {
  constexpr int kRows = 16;
  const xcb_gcontext_t context = xcb_generate_id(server);
  xcb_create_gc(server, context, pixmap, 0, nullptr);
  const auto row = std::size_t{4} * static_cast<std::size_t>(width_px);
  for (int from = 0; from < height_px; from += kRows) {
    const int rows = std::min(kRows, height_px - from);
    xcb_put_image(server, XCB_IMAGE_FORMAT_Z_PIXMAP, pixmap, context, static_cast<std::uint16_t>(width_px),
                  static_cast<std::uint16_t>(rows), 0, static_cast<std::int16_t>(from), 0, depth,
                  static_cast<std::uint32_t>(row * static_cast<std::size_t>(rows)),
                  bgrx.data() + row * static_cast<std::size_t>(from));
  }
  xcb_free_gc(server, context);
}

}  // namespace

std::unique_ptr<StallCover> StallCover::over(std::uint32_t window, int left_px, const RgbView& picture) {
  xcb_connection_t* const server = xcb_connect(nullptr, nullptr);
  const auto give_up = [server] {
    xcb_disconnect(server);
    return nullptr;
  };
  if (window == 0 || xcb_connection_has_error(server) != 0) return give_up();
  const Reply<xcb_get_geometry_reply_t> shape(xcb_get_geometry_reply(server, xcb_get_geometry(server, window), nullptr),
                                              &std::free);
  if (!shape || (shape->depth != 24 && shape->depth != 32)) return give_up();
  const xcb_pixmap_t pixmap = xcb_generate_id(server);
  xcb_create_pixmap(server, shape->depth, pixmap, window, static_cast<std::uint16_t>(picture.width_px),
                    static_cast<std::uint16_t>(picture.height_px));
  put_picture(server, pixmap, shape->depth, bgrx_of(picture.pixels), picture.width_px, picture.height_px);
  const xcb_window_t cover = xcb_generate_id(server);
  constexpr std::uint16_t kLarge = 16384;  // whatever size the window will have: the server cuts it off
  const std::array<std::uint32_t, 1> values{pixmap};
  xcb_create_window(server, XCB_COPY_FROM_PARENT, cover, window, static_cast<std::int16_t>(left_px), 0, kLarge, kLarge,
                    0, XCB_WINDOW_CLASS_INPUT_OUTPUT, XCB_COPY_FROM_PARENT, XCB_CW_BACK_PIXMAP, values.data());
  xcb_free_pixmap(server, pixmap);
  // A round trip: whatever was refused is known now.
  const Reply<xcb_get_geometry_reply_t> made(xcb_get_geometry_reply(server, xcb_get_geometry(server, cover), nullptr),
                                             &std::free);
  if (!made) return give_up();
  return std::unique_ptr<StallCover>(new StallCover(server, cover));
}

StallCover::StallCover(xcb_connection_t* server, std::uint32_t cover)
    : server_(server), cover_(cover), watching_([this](const std::stop_token& stop) { watch(stop); }) {}

StallCover::~StallCover() {
  watching_.request_stop();
  watching_.join();
  xcb_disconnect(server_);
}

void StallCover::believe_until(std::optional<HostTime> until) {
  if (until) believe_no_longer_than(*until);
  const std::lock_guard lock(mutex_);
  until_ = until;  // what is later needs no waking: the thread looks again when the earlier has passed
}

void StallCover::believe_no_longer_than(HostTime until) {
  const std::lock_guard lock(mutex_);
  if (until_ && *until_ <= until) return;
  until_ = until;
  earlier_.notify_one();
}

void StallCover::lift() {
  const std::lock_guard lock(mutex_);
  if (!covering_) return;
  covering_ = false;
  until_.reset();  // of what was covered nothing is on the screen any more
  xcb_unmap_window(server_, cover_);
  // An answer comes when all before it is done.
  const Reply<xcb_get_input_focus_reply_t> done(
      xcb_get_input_focus_reply(server_, xcb_get_input_focus(server_), nullptr), &std::free);
}

int StallCover::covered() const {
  const std::lock_guard lock(mutex_);
  return covered_;
}

void StallCover::watch(const std::stop_token& stop) {
  // Before whatever keeps the window's thread from running. Without the right to it the thread runs as any other.
  (void)schedule_this_thread_real_time();
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const std::optional<HostTime> until = until_;
    if (covering_ || !until) {
      earlier_.wait(lock, stop, [&] { return !covering_ && until_; });
    } else if (host_now() < *until) {
      earlier_.wait(lock, stop, *until, [&] { return until_ && *until_ < *until; });
    } else {
      // What the server sends to everybody would gather for ever.
      while (xcb_generic_event_t* const event = xcb_poll_for_event(server_)) std::free(event);
      xcb_map_window(server_, cover_);
      xcb_flush(server_);
      covering_ = true;
      ++covered_;
    }
  }
}

}  // namespace birdseye::host
