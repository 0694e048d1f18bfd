#include "host/overlay/shown_ct.hpp"

#include <utility>

#include "host/files/files_sha256.hpp"
#include "host/overlay/ct_sha256.hpp"
#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"

namespace birdseye::host {

Result<ShownCt> read_shown(const VolumeSource& source, const ShownChoice& choice,
                           const std::function<Result<void>(const Volume&)>& check) {
  if (choice.margins_mm.empty() != choice.margin_of.empty())
    return Error{Errc::bad_value, "--margins and --margin-of go together: how many mm, about which labels"};
  if (!choice.labels.empty() && choice.keep.empty() && choice.margins_mm.empty())
    return Error{Errc::bad_value, "--labels does nothing by itself: give --show too, or --margins with --margin-of"};
  auto ct = import_body(source);
  if (!ct) return ct.error();
  if (check) {
    if (auto sound = check(ct->volume); !sound) return sound.error();
  }
  ShownCt shown{std::move(ct->volume), std::nullopt, std::move(ct->notes)};
  if (choice.summed) shown.ct_sha256 = ct_sha256(shown.volume);
  if (choice.labels.empty()) return shown;
  if (choice.summed) {
    auto sum = files_sha256(choice.labels);
    if (!sum) return sum.error();
    shown.labels_sha256 = *std::move(sum);
  }
  const std::string file = choice.labels.string();
  const auto labels = import_named_labels(choice.labels, shown.volume, all_of({choice.keep, choice.margin_of}));
  if (!labels) return labels.error();
  shown.notes.insert(shown.notes.end(), labels->notes.begin(), labels->notes.end());
  if (!choice.margins_mm.empty()) {
    const auto values = values_of_labels(labels->names, choice.margin_of, &shown.notes);
    if (!values) return values.error().with_context(file);
    auto margins = margins_about(labels->volume, *values, choice.margins_mm);
    if (!margins) return margins.error().with_context(file);
    shown.margins = *std::move(margins);
  }
  if (choice.keep.empty()) return shown;
  const auto values = values_of_labels(labels->names, choice.keep, &shown.notes);
  if (!values) return values.error().with_context(file);
  auto kept = keep_labels(shown.volume, labels->volume, *values);
  if (!kept) return kept.error().with_context(file);
  shown.volume = *std::move(kept);
  return shown;
}

}  // namespace birdseye::host
