#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "device/wire/tls_link.hpp"

namespace birdseye::wire {

constexpr int kPairingPort = 18945;

/// Two machines that do not know each other yet have made a connection by TLS, and may have somebody between them. What
/// follows gives both a code of six digits that people compare. The client commits itself to a number before it knows
/// the server's, and the code is of both numbers, both keys and the connection's own secret: whoever stands between has
/// two connections, and one chance in a million that their codes are alike, without a second try.
struct Introduction {
  std::string code;  ///< as people read it, "042 917"
  std::string name;  ///< what the other machine calls itself; not to be believed
  PublicKey key;     ///< of the other machine
};

/// The exchange of the numbers. own_name: what this machine calls itself. begun, where given, is set once the other
/// side has committed itself, from when on this was the one try.
Result<Introduction> introduce(TlsLink& link, TlsLink::Side side, const std::string& own_name, Deadline deadline,
                               bool* begun = nullptr);

/// Tells the other side what the person at this one said, and hears what was said there. An error where either said no.
Result<void> agree(TlsLink& link, bool yes, Deadline deadline);

/// For the time of a pairing every key is let in.
Result<std::shared_ptr<const Tls>> pairing_tls(const MachineKey& key);

/// What becomes of an introduction where a person at each machine says that the codes are alike.
struct PairingPlan {
  std::filesystem::path folder;  ///< the identity's: the key is read from it, or made, and the other's is written to
                                 ///< it; both certificates too, as own.crt and NAME.crt, for programs that go by them
  std::string name;              ///< by which to know the other machine; empty: as it calls itself
  /// Shows the code and asks whether the other machine shows the same. By the deadline: later is no.
  std::function<bool(const Introduction&, Deadline)> ask;
};

/// Asks at the terminal.
bool ask_people(const Introduction& introduction, Deadline deadline);

struct Paired {
  std::string name;
  PublicKey key;
};

/// Waits for one machine, and for one try of it. listening, where given, is told the port once it listens.
Result<Paired> pair_as_server(const PairingPlan& plan, const std::string& bind_address, int port, Deadline deadline,
                              const std::function<void(int)>& listening = {});
Result<Paired> pair_as_client(const PairingPlan& plan, const std::string& host, int port, Deadline deadline);

}  // namespace birdseye::wire
