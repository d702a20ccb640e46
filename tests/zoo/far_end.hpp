// Where the master is: behind a pseudo-terminal with a link to it, or behind a TCP connection.
#pragma once

#include <memory>
#include <string>

#include "frame.hpp"

namespace zoo {

class FarEnd {
  public:
    FarEnd() = default;
    FarEnd(const FarEnd&) = delete;
    FarEnd& operator=(const FarEnd&) = delete;
    virtual ~FarEnd() = default;

    // What a loop waits on; -1: nothing. The descriptor is readable when there is something to read
    // or the connection has ended, the listener when a connection can be taken.
    virtual int descriptor() const = 0;
    virtual int listener() const { return -1; }
    virtual void accept() {}

    // Gone for whoever holds it; plug() brings it back, for tcp when the next one connects.
    virtual void unplug() = 0;
    virtual void plug() = 0;

    // From here on nothing is even acknowledged, as when a cable is pulled.
    virtual void sever(bool /*severed*/) {}

    // The link, or ADDRESS:PORT.
    virtual std::string name() const = 0;

    // All that has come; a connection that has ended is closed.
    Bytes read();

    // What does not fit is lost, as it is on a wire. True when there is somebody to hear it.
    bool write(const Bytes& bytes);

  protected:
    virtual void lost() {}
};

std::unique_ptr<FarEnd> make_pty(const std::string& link);
std::unique_ptr<FarEnd> make_tcp(int port);  // 0: a free one

}  // namespace zoo
