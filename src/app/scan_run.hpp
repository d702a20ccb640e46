#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <memory>
#include <optional>
#include <string>

#include "panelgate/line/drive.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/scan/progress.hpp"
#include "panelgate/scan/result.hpp"
#include "panelgate/scan/scanner.hpp"
#include "panelgate/scan/settings.hpp"

namespace panelgate::app {

/// Drives a Scanner over a line until it is done, the line fails or a signal comes. Says meanwhile
/// on stderr how far it is, when that is a terminal.
class ScanRun final : public line::Line::Events {
  public:
    /// `settings` and `profiles` outlive it.
    ScanRun(boost::asio::io_context& io, const scan::Settings& settings,
            const profile::Catalogue& profiles, const line::Settings& device);

    void run();
    /// Why it ended early; empty when it did not.
    const std::string& cut_short() const { return cut_short_; }
    /// The line came up.
    bool has_begun() const { return scanner_ != nullptr; }
    scan::Result result() const { return scanner_->result(); }

    void on_up() override;
    void on_down(const std::string& why) override { end(why); }
    void on_bytes(ByteView bytes) override;

    // Host of the scanner's drive
    void act(const scan::SetFormat& set) { line_->set_format(set.format); }
    void act(const scan::Transmit& transmit) { line_->write(scan::on_wire(transmit)); }
    void on_deadline(TimePoint now);
    void settled(TimePoint now);

  private:
    void end(const std::string& why);
    void redraw();

    boost::asio::io_context& io_;
    const scan::Settings& settings_;
    const profile::Catalogue& profiles_;
    rt::AsioClock clock_;
    std::unique_ptr<line::Line> line_;
    std::unique_ptr<scan::Scanner> scanner_;  ///< since the line is up
    std::optional<line::Drive<scan::Scanner, ScanRun>> drive_;
    std::unique_ptr<rt::Alarm> redraw_;
    boost::asio::signal_set signals_;
    std::string cut_short_;
};

}  // namespace panelgate::app
