#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <span>
#include <string>

#include "descriptor_line.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// Opens at once; reading and writing end as a test sets.
class FailingLine final : public DescriptorLine {
  public:
    FailingLine(const boost::asio::any_io_executor& executor, rt::Clock& clock,
                const Settings& settings, const Pty& pty)
        : DescriptorLine(executor, clock, settings), pty_(pty) {}
    ~FailingLine() override { stop(); }
    /// The device reports a hang-up.
    void lose() { lost("hang-up"); }
    /// The device delivers a byte.
    void bring() {
        bytes_ = 1;
        poll_input();
    }

    int read_error = EAGAIN;  ///< 0: end of file
    int write_error = 0;
    bool closed_for_good = false;  ///< the last closing discarded unsent bytes

  private:
    void begin_open() override {
        adopt(::dup(pty_.master()));
        opened();
    }
    void close_device(bool discard) override {
        closed_for_good = discard;
        DescriptorLine::close_device(discard);
    }
    ssize_t get(std::span<std::uint8_t> room) override {
        if (bytes_ > 0) {
            --bytes_;
            room[0] = 0x55;
            return 1;
        }
        errno = read_error;
        return read_error == 0 ? 0 : -1;
    }
    ssize_t put(ByteView bytes) override {
        errno = write_error;
        return write_error == 0 ? static_cast<ssize_t>(bytes.size()) : -1;
    }

    const Pty& pty_;
    int bytes_ = 0;
};

}  // namespace panelgate::line
