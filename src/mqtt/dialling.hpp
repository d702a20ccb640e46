#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <string>

#include "connection.hpp"

namespace panelgate::mqtt {

/// Makes connections beside the loop: names are looked up, and a silent network is waited for, in a
/// thread of their own that nobody waits for, also at the program's end. One at a time.
class Dialling {
  public:
    /// With the connection, and why it could not be made.
    using Done = std::function<void(std::shared_ptr<Connection>, const std::string& failed)>;

    explicit Dialling(boost::asio::any_io_executor executor);
    ~Dialling();
    Dialling(const Dialling&) = delete;
    Dialling& operator=(const Dialling&) = delete;

    /// `done` comes from the loop, once, unless cancel() or the end of this object is sooner. Not
    /// while one is under way.
    void connect(std::shared_ptr<Connection> connection, Message will, Done done);
    void cancel();
    bool under_way() const;

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< the thread's share of it
};

}  // namespace panelgate::mqtt
