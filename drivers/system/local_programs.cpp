#include "drivers/system/local_programs.hpp"

#include <netinet/in.h>
#include <stdlib.h>
#include <sys/socket.h>

#include "drivers/system/unique_fd.hpp"

namespace birdseye {

std::string beside_us(const std::string& name) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path candidate = self.parent_path() / name;
  return std::filesystem::exists(candidate, error) ? candidate.string() : name;
}

Result<int> free_port() {
  const UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool bound = fd && ::bind(fd.get(), reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                     ::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size) == 0;
  if (!bound) return Error{Errc::in_use, "127.0.0.1: no TCP port is free"};
  return static_cast<int>(ntohs(address.sin_port));
}

Result<std::unique_ptr<RendezvousFolder>> RendezvousFolder::make() {
  std::string path = (std::filesystem::temp_directory_path() / "birdseye-XXXXXX").string();
  if (::mkdtemp(path.data()) == nullptr) return Error{Errc::unreadable, path + ": cannot be created"};
  return std::unique_ptr<RendezvousFolder>(new RendezvousFolder(path));
}

RendezvousFolder::~RendezvousFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace birdseye
