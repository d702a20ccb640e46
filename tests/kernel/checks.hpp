#pragma once

#include <string>

namespace panelgate::line {

/// Runs every check against serial ports of the running kernel. Each prints "ok NAME DETAIL" or
/// "not ok NAME DETAIL". host.py plays the other end of `port`: it sends every byte back inverted
/// and does what lines "host: ..." of our output ask for. Needs to be root and alone.
class Checks {
  public:
    explicit Checks(std::string port) : port_(std::move(port)) {}
    /// How many failed.
    int run();
    int count() const { return count_; }

  private:
    void formats();
    void rates();
    void bytes();
    void earlier_users();
    void breaks();
    void exclusive();
    void sending();
    void queue();
    void low_latency();
    void not_serial();
    void absent();
    void unplug();

    void check(const std::string& name, bool good, const std::string& detail = {});

    std::string port_;
    int count_ = 0;
    int failed_ = 0;
};

}  // namespace panelgate::line
