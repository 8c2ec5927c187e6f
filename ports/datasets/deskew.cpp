#include "ports/datasets/deskew.hpp"

#include <utility>
#include <vector>

#include "ports/datasets/decorator.hpp"
#include "ports/datasets/sensor_motion.hpp"
#include "ports/datasets/sweep_motion.hpp"

namespace unimapper::datasets {
namespace {

class DeskewedDataset : public DatasetDecorator {
 public:
  DeskewedDataset(std::unique_ptr<Dataset> inner, Deskew mode)
      : DatasetDecorator(std::move(inner)), motion_(DatasetDecorator::inner()) {
    check_ = check_sweeps(DatasetDecorator::inner(), motion_);
    is_applied_ = mode == Deskew::kOn || check_.finding == SweepFinding::kSharper;
  }

  void read_scan(std::size_t i, Scan& scan) const override {
    inner().read_scan(i, scan);
    if (is_applied_) deskew(motion_, inner().stamp_ns(i), scan);
  }

  [[nodiscard]] std::vector<Note> notes() const override {
    std::vector<Note> notes = inner().notes();
    if (check_.finding == SweepFinding::kNoTimes) return notes;
    const bool is_warning = check_.finding == SweepFinding::kUnclear ||
                            check_.finding == SweepFinding::kReversed ||
                            check_.finding == SweepFinding::kOtherEnd ||
                            (is_applied_ && check_.finding == SweepFinding::kCompensated);
    std::string text = check_.text();
    if (is_applied_ && check_.finding != SweepFinding::kSharper) {
      text = "compensated all the same: " + text;
    }
    notes.push_back({std::move(text), is_warning});
    return notes;
  }

 private:
  SensorMotion motion_;
  SweepCheck check_;
  bool is_applied_ = false;
};

}  // namespace

std::unique_ptr<Dataset> deskewed(std::unique_ptr<Dataset> dataset, Deskew mode) {
  if (mode == Deskew::kOff) return dataset;
  return std::make_unique<DeskewedDataset>(std::move(dataset), mode);
}

}  // namespace unimapper::datasets
