#pragma once

#include <functional>
#include <string>

namespace panelgate::line {

/// Runs every check against serial ports of the running kernel. Each prints "ok NAME DETAIL" or
/// "not ok NAME DETAIL". host.py plays the other end of `port`: it sends every byte back inverted
/// and does what lines "host: ..." of our output ask for. Needs to be root and alone.
class Checks {
  public:
    explicit Checks(std::string port) : port_(std::move(port)) {}
    /// Of a 16550 and the 8250 driver.
    void run_uart();
    /// Of an FTDI adapter on USB and ftdi_sio. Not breaks: qemu's adapter reports them without the
    /// byte that the driver waits for.
    void run_adapter();
    int count() const { return count_; }
    int failed() const { return failed_; }

  private:
    void formats();
    void odd_rate();
    void rate_above_base();
    void rate_of_adapter();
    void bytes();
    void earlier_users();
    void stopped_output();
    void breaks();
    void exclusive();
    void sending();
    void queue();
    void low_latency();
    void not_serial();
    void absent();
    void adapter_timer();
    void unbind();
    void unplug();
    /// What a user of the port notices of `take`, and that it works again after `give`.
    void take_away(const std::function<void()>& take, const std::function<void()>& give);

    void check(const std::string& name, bool good, const std::string& detail = {});

    std::string port_;
    int count_ = 0;
    int failed_ = 0;
};

}  // namespace panelgate::line
