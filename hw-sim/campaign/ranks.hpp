#pragma once

#include <memory>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::hw_sim {

/// The programs, one a rank, that an mpirun of Open MPI started together, on one machine or several. Open MPI is loaded
/// at run time: no program of ours needs it to be installed. One thread alone uses this.
class Ranks {
 public:
  /// Joins the others; nullptr where no mpirun started this program, or this one alone. Refused: programs that another
  /// MPI or srun started together.
  static Result<std::unique_ptr<Ranks>> join();
  /// Ends all ranks, where this one has not left before.
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return size_; }

  struct Message {
    int rank = 0;  ///< whose it is
    int kind = 0;
    std::string text;
  };
  void send(int to, int kind, const std::string& text);
  /// The next message that another rank has sent; empty at the deadline. In between it sleeps, where MPI's own waits
  /// keep a core busy.
  std::optional<Message> receive(Deadline deadline);

  /// Once nothing more is to be sent; waits until all have come so far.
  void leave();
  [[nodiscard]] bool left() const { return left_; }
  /// Says why, and ends all ranks.
  [[noreturn]] void give_up(const Error& why);

 private:
  struct OpenMpi;
  explicit Ranks(std::unique_ptr<OpenMpi> mpi);
  std::unique_ptr<OpenMpi> mpi_;
  int rank_ = 0, size_ = 1;
  bool left_ = false;
};

}  // namespace birdseye::hw_sim
