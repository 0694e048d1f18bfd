#include "host/operation/operation_keeper.hpp"

#include <fmt/format.h>

#include <utility>

#include "drivers/system/clock.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

OperationKeeper::OperationKeeper(std::filesystem::path out, std::filesystem::path resume)
    : out_(std::move(out)), resume_(std::move(resume)) {}

Result<std::optional<Operation>> OperationKeeper::take_up(const std::string& ct_checksum) {
  const std::filesystem::path folder = std::exchange(resume_, {});
  if (folder.empty()) return std::optional<Operation>();
  auto operation = read_operation(folder);
  if (operation && operation->ct_checksum != ct_checksum) {
    operation = Error{Errc::bad_value,
                      fmt::format("{}: is of another CT; give that CT, or go on without --resume", folder.string())};
  }
  if (!operation) {
    out_.clear();
    return operation.error();
  }
  return std::optional(*std::move(operation));
}

void OperationKeeper::keep(Operation operation) {
  if (out_.empty() || !resume_.empty()) return;
  operation.made_utc = utc_now();
  const auto written = write_operation(out_, operation);
  fault_ = written ? "" : words("note_not_kept", written.error().what);
}

}  // namespace birdseye::host
