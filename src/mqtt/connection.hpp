#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/mqtt/settings.hpp"
#include "panelgate/mqtt/subjects.hpp"

struct mosquitto;

namespace panelgate::mqtt {

/// The messages of one connection that the broker may not have. Those of quality of service 0 are
/// there when a barrier behind them is acknowledged. Pure.
class OpenMessages {
  public:
    /// `change`: 0 where it is none.
    void sent(int id, bool acknowledged, std::uint64_t change) {
        if (acknowledged) {
            open_[id] = {change};
        } else {
            unconfirmed_.push_back(change);
        }
    }
    /// There are some behind the last barrier, and it has been acknowledged.
    bool wants_barrier() const { return !barrier_ && !unconfirmed_.empty(); }
    /// It was sent behind all of them; 0: it could not be.
    void barrier(int id) {
        if (id == 0) return;
        barrier_ = id;
        behind_.swap(unconfirmed_);
    }
    /// The changes that the broker has now.
    std::vector<std::uint64_t> delivered(int id) {
        if (barrier_ == id) {
            barrier_.reset();
            return std::exchange(behind_, {});
        }
        const auto found = open_.find(id);
        if (found == open_.end()) return {};
        std::vector<std::uint64_t> changes = std::move(found->second);
        open_.erase(found);
        return changes;
    }
    std::size_t size() const { return open_.size() + unconfirmed_.size() + behind_.size(); }
    void clear() { *this = {}; }

  private:
    std::map<int, std::vector<std::uint64_t>> open_;  ///< each until it is acknowledged
    std::vector<std::uint64_t> unconfirmed_;          ///< behind the last barrier
    std::vector<std::uint64_t> behind_;               ///< in front of it
    std::optional<int> barrier_;
};

/// One connection to the broker, from its making to its end: a session of libmosquitto that is
/// never used again. Does nothing by itself; one thread at a time. "" is success, anything else is
/// why the connection is over.
class Connection {
  public:
    Connection(const Settings& settings, const std::string& client_id);
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    /// Looks the name up and connects; waits for as long as the system does.
    std::string connect(const Message& will);
    /// -1: none.
    int socket() const;
    bool wants_write() const;
    std::string read();
    std::string write();
    /// Once a second.
    std::string look_after();

    /// What it is called in Happened::delivered; 0: it could not be sent.
    int publish(const Message& message);
    bool subscribe(const std::string& filter);
    /// Acknowledged behind everything that was published before: for messages of quality of service
    /// 0, which nobody acknowledges. An UNSUBSCRIBE from nothing (MQTT 3.1.1, 3.10.4). 0: not sent.
    int barrier();
    /// Takes leave: nobody is told that it was lost.
    void disconnect();

    struct Received {
        std::string topic;
        std::string payload;
        bool retained = false;
    };
    /// What has come since the last call.
    struct Happened {
        bool accepted = false;
        std::string refused;         ///< by the broker, and why
        std::vector<int> delivered;  ///< of publish() and barrier()
        std::vector<Received> received;
    };
    Happened take();

  private:
    struct Callbacks;
    std::string set_up(const Message& will);
    std::string set_up_tls();

    const Settings settings_;
    Happened happened_;
    std::unique_ptr<mosquitto, void (*)(mosquitto*)> session_;
};

}  // namespace panelgate::mqtt
