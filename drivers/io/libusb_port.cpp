#include "drivers/io/libusb_port.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <fstream>
#include <mutex>
#include <utility>

#include "drivers/system/clock.hpp"

namespace birdseye::drivers {

namespace {

constexpr int kInterface = 0;
constexpr int kMostFailuresInARow = 32;
constexpr Duration kDrain = Duration::from_ms(1000);
constexpr std::uint16_t kLargestPacket = 1024;

struct ContextEnd {
  void operator()(libusb_context* context) const { libusb_exit(context); }
};
struct HandleEnd {
  void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
};
struct DevicesEnd {
  void operator()(libusb_device** devices) const { libusb_free_device_list(devices, 1); }
};
struct DescriptorEnd {
  void operator()(libusb_config_descriptor* descriptor) const { libusb_free_config_descriptor(descriptor); }
};
using Context = std::unique_ptr<libusb_context, ContextEnd>;
using Handle = std::unique_ptr<libusb_device_handle, HandleEnd>;
using Devices = std::unique_ptr<libusb_device*, DevicesEnd>;

unsigned timeout_ms(Deadline deadline) {
  return static_cast<unsigned>(
      std::clamp<std::int64_t>((deadline.left().ns + 999'999) / 1'000'000, 1, 60'000));  // 0 would be for ever
}

/// What the kernel has read from the device when it came; asking the device itself takes the right to open it.
std::string kernel_text(libusb_device* device, const char* file) {
  std::array<std::uint8_t, 8> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  if (depth <= 0) return {};
  std::string path = fmt::format("/sys/bus/usb/devices/{}-", libusb_get_bus_number(device));
  for (std::size_t i = 0; i < static_cast<std::size_t>(depth); ++i)
    path += fmt::format("{}{}", i == 0 ? "" : ".", ports[i]);
  std::ifstream in(path + "/" + file);
  std::string text;
  std::getline(in, text);
  return text;
}

struct Endpoints {
  std::uint8_t in = 0, out = 0;
  std::uint16_t max_packet = 0;
};

Result<Endpoints> find_endpoints(libusb_device* device, const std::string& name) {
  libusb_config_descriptor* raw = nullptr;
  if (const int code = libusb_get_active_config_descriptor(device, &raw); code != 0)
    return usb_error(name, code, "read its descriptors");
  const std::unique_ptr<libusb_config_descriptor, DescriptorEnd> config(raw);
  Endpoints found;
  if (config->bNumInterfaces > kInterface && config->interface[kInterface].num_altsetting > 0) {
    const libusb_interface_descriptor& interface = config->interface[kInterface].altsetting[0];
    for (int i = 0; i < interface.bNumEndpoints; ++i) {
      const libusb_endpoint_descriptor& endpoint = interface.endpoint[i];
      if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
      if ((endpoint.bEndpointAddress & LIBUSB_ENDPOINT_DIR_MASK) == LIBUSB_ENDPOINT_IN) {
        found.in = endpoint.bEndpointAddress;
        found.max_packet = endpoint.wMaxPacketSize;
      } else {
        found.out = endpoint.bEndpointAddress;
      }
    }
  }
  if (found.in == 0 || found.out == 0 || found.max_packet < 8 || found.max_packet > kLargestPacket) {
    return Error{Errc::unsupported, fmt::format("{}: has no bulk endpoint each way; it is no serial adapter", name)};
  }
  return found;
}

/// The IN transfers. They are libusb's while in flight, so they stay where they are until each has come back.
class Reading {
 public:
  Reading(libusb_device_handle* handle, const Endpoints& endpoints, int transfers) {
    for (int i = 0; i < transfers; ++i) {
      Slot& slot = slots_.emplace_back();
      slot.owner = this;
      slot.buffer.resize(endpoints.max_packet);
      slot.transfer = libusb_alloc_transfer(0);
      if (slot.transfer == nullptr) continue;
      // No deadline: a device that has nothing to say may let it wait. It ends by data, unplugging or cancelling.
      libusb_fill_bulk_transfer(slot.transfer, handle, endpoints.in, slot.buffer.data(), endpoints.max_packet,
                                &finished, &slot, 0);
    }
  }
  ~Reading() {
    for (const Slot& slot : slots_) libusb_free_transfer(slot.transfer);
  }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  struct Slot {
    Reading* owner = nullptr;
    libusb_transfer* transfer = nullptr;
    std::vector<std::uint8_t> buffer;
    DeviceTime arrived;
  };

  int submit(Slot& slot) {
    const std::lock_guard lock(mutex_);
    const int code =
        slot.transfer == nullptr ? static_cast<int>(LIBUSB_ERROR_NO_MEM) : libusb_submit_transfer(slot.transfer);
    if (code == 0) ++in_flight_;
    return code;
  }
  int submit_all() {
    for (Slot& slot : slots_) {
      if (const int code = submit(slot); code != 0) return code;
    }
    return 0;
  }
  Slot* next_finished() {
    const std::lock_guard lock(mutex_);
    if (finished_.empty()) return nullptr;
    Slot* const slot = finished_.front();
    finished_.pop_front();
    return slot;
  }
  void cancel_all() {
    for (const Slot& slot : slots_) {
      if (slot.transfer != nullptr) libusb_cancel_transfer(slot.transfer);  // one that is not in flight refuses
    }
  }
  [[nodiscard]] int in_flight() const {
    const std::lock_guard lock(mutex_);
    return in_flight_;
  }

 private:
  // Called in whichever thread handles libusb's events just then.
  static void LIBUSB_CALL finished(libusb_transfer* transfer) {
    const DeviceTime arrived = device_now();
    Slot* const slot = static_cast<Slot*>(transfer->user_data);
    const std::lock_guard lock(slot->owner->mutex_);
    slot->arrived = arrived;
    slot->owner->finished_.push_back(slot);
    --slot->owner->in_flight_;
  }

  std::deque<Slot> slots_;
  mutable std::mutex mutex_;
  std::deque<Slot*> finished_;
  int in_flight_ = 0;
};

class LibusbPort final : public UsbPort {
 public:
  LibusbPort(Context context, Handle handle, const Endpoints& endpoints, UsbIdentity identity)
      : context_(std::move(context)),
        handle_(std::move(handle)),
        endpoints_(endpoints),
        identity_(std::move(identity)) {}
  ~LibusbPort() override;

  [[nodiscard]] const UsbIdentity& identity() const override { return identity_; }
  Result<std::vector<std::uint8_t>> control(const SetupPacket& setup, Deadline deadline) override;
  Result<std::size_t> bulk_out(std::span<const std::uint8_t> bytes, Deadline deadline) override;
  Result<void> start_reading(int transfers) override;
  Result<std::optional<UsbInput>> collect(Deadline deadline) override;
  void wake() override;

 private:
  Result<std::optional<UsbInput>> settle(Reading::Slot& slot);
  void handle_events(Duration most, int& code);

  Context context_;
  Handle handle_;
  Endpoints endpoints_;
  UsbIdentity identity_;
  std::unique_ptr<Reading> reading_;
  std::atomic<bool> woken_ = false;
  int failures_in_a_row_ = 0;
  int broken_ = 0;  ///< libusb's code for why there will be no more input
};

LibusbPort::~LibusbPort() {
  if (reading_) {
    reading_->cancel_all();
    int code = 0;
    for (const Deadline until = Deadline::after(kDrain); reading_->in_flight() > 0 && !until.passed();)
      handle_events(Duration::from_ms(10), code);
    if (reading_->in_flight() > 0) {
      // The kernel still holds buffers of ours: to give them up would let it write into somebody else's memory.
      (void)reading_.release();
      (void)handle_.release();
      (void)context_.release();
      return;
    }
  }
  reading_.reset();
  libusb_release_interface(handle_.get(), kInterface);  // and the kernel's driver is back
}

void LibusbPort::handle_events(Duration most, int& code) {
  timeval wait{};
  wait.tv_usec = static_cast<suseconds_t>(std::clamp<std::int64_t>(most.ns / 1000, 0, 999'999));
  code = libusb_handle_events_timeout_completed(context_.get(), &wait, nullptr);
}

Result<std::vector<std::uint8_t>> LibusbPort::control(const SetupPacket& setup, Deadline deadline) {
  const auto word = [&](std::size_t at) { return static_cast<std::uint16_t>(setup[at] | setup[at + 1] << 8); };
  std::vector<std::uint8_t> reply(word(6));
  const int got = libusb_control_transfer(handle_.get(), setup[0], setup[1], word(2), word(4), reply.data(), word(6),
                                          timeout_ms(deadline));
  if (got < 0) return usb_error(identity_.name, got, "send it a request");
  if (static_cast<std::size_t>(got) != reply.size()) {
    return Error{Errc::bad_format,
                 fmt::format("{}: answers a request with {} bytes instead of {}", identity_.name, got, reply.size())};
  }
  return reply;
}

Result<std::size_t> LibusbPort::bulk_out(std::span<const std::uint8_t> bytes, Deadline deadline) {
  int put = 0;
  const int code = libusb_bulk_transfer(handle_.get(), endpoints_.out, const_cast<std::uint8_t*>(bytes.data()),
                                        static_cast<int>(bytes.size()), &put, timeout_ms(deadline));
  if (code != 0 && code != LIBUSB_ERROR_TIMEOUT) return usb_error(identity_.name, code, "send to it");
  return static_cast<std::size_t>(put);
}

Result<void> LibusbPort::start_reading(int transfers) {
  reading_ = std::make_unique<Reading>(handle_.get(), endpoints_, transfers);
  if (const int code = reading_->submit_all(); code != 0) return usb_error(identity_.name, code, "read from it");
  return {};
}

Result<std::optional<UsbInput>> LibusbPort::settle(Reading::Slot& slot) {
  std::optional<UsbInput> input;
  switch (slot.transfer->status) {
    case LIBUSB_TRANSFER_COMPLETED:
    case LIBUSB_TRANSFER_TIMED_OUT:
      failures_in_a_row_ = 0;
      input = UsbInput{{slot.buffer.begin(), slot.buffer.begin() + slot.transfer->actual_length}, slot.arrived, false};
      break;
    case LIBUSB_TRANSFER_ERROR:
    case LIBUSB_TRANSFER_OVERFLOW:
      if (++failures_in_a_row_ > kMostFailuresInARow) broken_ = LIBUSB_ERROR_IO;
      input = UsbInput{{}, slot.arrived, true};
      break;
    case LIBUSB_TRANSFER_STALL:
      broken_ = LIBUSB_ERROR_IO;  // no FTDI chip does that; a new start cures it
      break;
    default:  // no device; and nobody but the destructor cancels
      broken_ = LIBUSB_ERROR_NO_DEVICE;
      break;
  }
  if (broken_ == 0) broken_ = reading_->submit(slot);
  if (!input) return usb_error(identity_.name, broken_, "read from it");
  return input;
}

Result<std::optional<UsbInput>> LibusbPort::collect(Deadline deadline) {
  for (;;) {
    if (Reading::Slot* const slot = reading_ ? reading_->next_finished() : nullptr) return settle(*slot);
    if (broken_ != 0) return usb_error(identity_.name, broken_, "read from it");
    if (woken_.exchange(false) || deadline.passed()) return std::optional<UsbInput>();
    int code = 0;
    handle_events(deadline.left(), code);
    if (code != 0 && code != LIBUSB_ERROR_INTERRUPTED && code != LIBUSB_ERROR_TIMEOUT) broken_ = code;
  }
}

void LibusbPort::wake() {
  woken_ = true;
  libusb_interrupt_event_handler(context_.get());
}

}  // namespace

Error usb_error(const std::string& name, int libusb_code, const char* doing) {
  switch (libusb_code) {
    case LIBUSB_ERROR_ACCESS:
      return {Errc::unreadable,
              fmt::format("{}: no permission; install packaging/60-birdseye.rules under /etc/udev/rules.d, add this "
                          "user to the group dialout and plug the adapter in again",
                          name)};
    case LIBUSB_ERROR_BUSY:
      return {Errc::in_use, fmt::format("{}: held by another program; stop that one first", name)};
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return {Errc::disconnected, fmt::format("{}: the adapter is gone; was it unplugged?", name)};
    case LIBUSB_ERROR_IO:
    case LIBUSB_ERROR_OVERFLOW:
      return {Errc::disconnected, fmt::format("{}: the bus fails; check the cable and the hub", name)};
    case LIBUSB_ERROR_TIMEOUT:
      return {Errc::timeout, fmt::format("{}: the adapter does not react; unplug it and plug it in again", name)};
    case LIBUSB_ERROR_PIPE:
      return {Errc::unsupported, fmt::format("{}: the adapter refuses what was asked of it", name)};
    default:
      return {Errc::io,
              fmt::format("{}: cannot {}: {}", name, doing, libusb_strerror(static_cast<libusb_error>(libusb_code)))};
  }
}

Result<std::unique_ptr<UsbPort>> open_libusb_port(const UsbAddress& address) {
  libusb_context* raw_context = nullptr;
  if (const int code = libusb_init(&raw_context); code != 0)
    return usb_error(address.name, code, "look for USB devices");
  Context context(raw_context);
  libusb_device** raw_devices = nullptr;
  const ssize_t count = libusb_get_device_list(context.get(), &raw_devices);
  if (count < 0) return usb_error(address.name, static_cast<int>(count), "list the USB devices");
  const Devices devices(raw_devices);

  std::vector<UsbCandidate> candidates;
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor descriptor{};
    libusb_get_device_descriptor(raw_devices[i], &descriptor);
    candidates.push_back({descriptor.idVendor, descriptor.idProduct, kernel_text(raw_devices[i], "product"),
                          kernel_text(raw_devices[i], "serial")});
  }
  const auto chosen = choose_adapter(candidates, address);
  if (!chosen) return chosen.error();

  libusb_device* const device = raw_devices[*chosen];
  libusb_device_descriptor descriptor{};
  libusb_get_device_descriptor(device, &descriptor);
  const auto endpoints = find_endpoints(device, address.name);
  if (!endpoints) return endpoints.error();
  libusb_device_handle* raw_handle = nullptr;
  if (const int code = libusb_open(device, &raw_handle); code != 0) return usb_error(address.name, code, "open it");
  Handle handle(raw_handle);
  libusb_set_auto_detach_kernel_driver(handle.get(), 1);
  if (const int code = libusb_claim_interface(handle.get(), kInterface); code != 0)
    return usb_error(address.name, code, "claim it");
  UsbIdentity identity{address.name,
                       address.vendor,
                       address.product,
                       descriptor.bcdDevice,
                       candidates[*chosen].product_text,
                       candidates[*chosen].serial,
                       descriptor.iSerialNumber != 0,
                       endpoints->max_packet};
  return std::unique_ptr<UsbPort>(
      std::make_unique<LibusbPort>(std::move(context), std::move(handle), *endpoints, std::move(identity)));
}

}  // namespace birdseye::drivers
