#include "hw-sim/campaign/ranks.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <type_traits>
#include <utility>

#include "drivers/system/program.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::hw_sim {

namespace {

// What mpi.h of Open MPI 4 and 5 says, both of which call their library libmpi.so.40: its binary interface is the same.
// Other MPIs have other handles, and are refused.
constexpr const char* kLibrary = "libmpi.so.40";
constexpr int kAnySource = -1, kAnyTag = -1, kThreadFunneled = 1;

Error not_open_mpi(const std::string& what) {
  return {Errc::unsupported,
          what + "; start this with the mpirun of Open MPI 4 or 5 (on Debian: openmpi-bin, on each of the machines)"};
}

/// Of a variable of the environment; 0 where there is none.
int number_in(const char* variable) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? 0 : std::atoi(text);
}

}  // namespace

struct Ranks::OpenMpi {
  struct Status {
    int source, tag, error, cancelled;
    std::size_t bytes;
  };
  using Handle = void*;  // a communicator, or a type: the address of an object of the library

  int (*init_thread)(int*, char***, int, int*);
  int (*comm_rank)(Handle, int*);
  int (*comm_size)(Handle, int*);
  int (*send)(const void*, int, Handle, int, int, Handle);
  int (*receive)(void*, int, Handle, int, int, Handle, Status*);
  int (*probe)(int, int, Handle, int*, Status*);
  int (*count)(const Status*, Handle, int*);
  int (*finalize)();
  int (*abort)(Handle, int);
  Handle world, byte;

  static Result<std::unique_ptr<OpenMpi>> load() {
    // Its plug-ins look for its names among those of the whole program.
    void* const library = ::dlopen(kLibrary, RTLD_NOW | RTLD_GLOBAL);
    if (library == nullptr) return not_open_mpi(fmt::format("mpirun: {} cannot be loaded here", kLibrary));
    auto out = std::make_unique<OpenMpi>();
    bool all = true;
    const auto find = [&](auto& into, const char* name) {
      into = reinterpret_cast<std::remove_reference_t<decltype(into)>>(::dlsym(library, name));
      all = all && into != nullptr;
    };
    find(out->init_thread, "MPI_Init_thread");
    find(out->comm_rank, "MPI_Comm_rank");
    find(out->comm_size, "MPI_Comm_size");
    find(out->send, "MPI_Send");
    find(out->receive, "MPI_Recv");
    find(out->probe, "MPI_Iprobe");
    find(out->count, "MPI_Get_count");
    find(out->finalize, "MPI_Finalize");
    find(out->abort, "MPI_Abort");
    find(out->world, "ompi_mpi_comm_world");
    find(out->byte, "ompi_mpi_byte");
    if (!all) return not_open_mpi(fmt::format("mpirun: {} is not Open MPI's", kLibrary));
    return out;
  }
};

Ranks::Ranks(std::unique_ptr<OpenMpi> mpi) : mpi_(std::move(mpi)) {
  mpi_->comm_rank(mpi_->world, &rank_);
  mpi_->comm_size(mpi_->world, &size_);
}

Ranks::~Ranks() {
  if (!left_) mpi_->abort(mpi_->world, static_cast<int>(ExitCode::unusable_input));
}

Result<std::unique_ptr<Ranks>> Ranks::join() {
  constexpr const char* kSize = "OMPI_COMM_WORLD_SIZE";
  if (std::getenv(kSize) == nullptr) {
    // Each of them would run all seeds.
    if (number_in("PMI_SIZE") < 2 && std::getenv("PMIX_RANK") == nullptr) return std::unique_ptr<Ranks>();
    return not_open_mpi("another MPI, or srun, started several of this program, or --alone is missing");
  }
  if (number_in(kSize) < 2) return std::unique_ptr<Ranks>();
  auto mpi = OpenMpi::load();
  if (!mpi) return mpi.error();
  // An error of MPI's ends all ranks, with its own words: it returns none.
  int level = 0;
  (*mpi)->init_thread(nullptr, nullptr, kThreadFunneled, &level);
  return std::unique_ptr<Ranks>(new Ranks(*std::move(mpi)));
}

void Ranks::send(int to, int kind, const std::string& text) {
  mpi_->send(text.data(), static_cast<int>(text.size()), mpi_->byte, to, kind, mpi_->world);
}

std::optional<Ranks::Message> Ranks::receive(Deadline deadline) {
  constexpr Duration kFirst = {20'000}, kLongest = Duration::from_ms(2);
  constexpr int kLooks = 8;  // Open MPI asks its sockets at every eighth only
  for (Duration pause = kFirst;; pause = std::min(pause + pause, kLongest)) {
    OpenMpi::Status status{};
    int there = 0;
    for (int look = 0; look < kLooks && there == 0; ++look)
      mpi_->probe(kAnySource, kAnyTag, mpi_->world, &there, &status);
    if (there != 0) {
      int bytes = 0;
      mpi_->count(&status, mpi_->byte, &bytes);
      Message out{status.source, status.tag, std::string(static_cast<std::size_t>(bytes), '\0')};
      mpi_->receive(out.text.data(), bytes, mpi_->byte, out.rank, out.kind, mpi_->world, &status);
      return out;
    }
    if (deadline.passed()) return std::nullopt;
    sleep_for(std::min(pause, deadline.left()));
  }
}

void Ranks::leave() {
  left_ = true;
  mpi_->finalize();
}

void Ranks::give_up(const Error& why) {
  left_ = true;
  print_error("birdseye-sim", fmt::format("rank {}: {}", rank_, why.what));
  mpi_->abort(mpi_->world, static_cast<int>(ExitCode::unusable_input));
  std::abort();  // not reached
}

}  // namespace birdseye::hw_sim
