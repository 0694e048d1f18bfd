#include "drivers/identity/followed_keys.hpp"

namespace birdseye {

Result<std::unique_ptr<FollowedKeys>> FollowedKeys::open(const std::filesystem::path& folder,
                                                         const KnownKeys::Machine& own) {
  auto known = KnownKeys::read(folder, own);
  if (!known) return known.error();
  return std::unique_ptr<FollowedKeys>(new FollowedKeys(folder, own, *std::move(known)));
}

std::string FollowedKeys::follow() {
  auto known = KnownKeys::read(folder_, own_);
  if (!known) return known.error().what;
  known_ = *std::move(known);
  return {};
}

std::optional<std::string> FollowedKeys::name_of(const PublicKey& key) {
  const std::lock_guard lock(mutex_);
  (void)follow();  // fault() tells
  return known_.name_of(key);
}

std::string FollowedKeys::fault() {
  const std::lock_guard lock(mutex_);
  return follow();
}

}  // namespace birdseye
