#pragma once

#include <map>

#include "panelgate/mqtt/settings.hpp"
#include "panelgate/mqtt/subjects.hpp"
#include "sparkplug_payload.hpp"

namespace panelgate::mqtt {

/// Sparkplug B (Sparkplug 3.0): the gateway is an edge node, each station with points a device, a
/// subject's number its alias.
class Sparkplug final : public MessageFormat {
  public:
    /// The subjects must outlive it.
    Sparkplug(const Settings& settings, const Subjects& subjects);

    Message will() override;
    Message farewell(WallTime now) override;
    std::vector<std::string> subscriptions() const override;
    std::vector<std::string> retained() const override { return {}; }
    std::size_t steps_before() const override { return 1 + devices_.size(); }
    std::size_t steps_behind() const override { return 0; }
    std::optional<Message> before(std::size_t step, const States& states, std::uint64_t next_change,
                                  WallTime now) override;
    std::optional<Message> behind(std::size_t, const States&) override { return std::nullopt; }
    std::optional<Message> change(const Change& change, const States& states,
                                  std::uint64_t next_change, WallTime now) override;
    std::vector<Command> commands(std::string_view topic, std::string_view payload,
                                  bool retained) const override;
    std::string topic_of(std::size_t point) const override;
    std::optional<Message> result(const WriteResult&) const override { return std::nullopt; }

  private:
    /// The published birth state of a station or of the node.
    struct Birth {
        bool alive = false;
        std::uint64_t next_change = 0;  ///< at birth; older changes are historical
    };

    std::string topic(std::string_view kind, std::string_view device = {}) const;
    Message message(std::string_view kind, std::string_view device,
                    const std::vector<Metric>& metrics, WallTime now);
    Message death(WallTime now) const;
    Message node_birth(const States& states, std::uint64_t next_change, WallTime now);
    Message device_birth(std::size_t station, const States& states, std::uint64_t next_change,
                         WallTime now);
    std::optional<Message> station_change(const Change& change, const States& states,
                                          std::uint64_t next_change, WallTime now);
    Metric metric(std::size_t subject, const std::optional<State>& state, bool birth,
                  WallTime now) const;
    std::vector<Command> device_commands(std::size_t station, std::string_view topic,
                                         const std::vector<ReceivedMetric>& metrics) const;

    Settings settings_;
    const Subjects& subjects_;
    std::vector<std::size_t> devices_;       ///< stations with points
    std::map<std::size_t, Birth> stations_;  ///< by their subject
    Birth node_;
    std::uint64_t next_death_ = 0;  ///< bdSeq of the next connection
    std::uint64_t death_ = 0;       ///< ... of this one
    std::uint8_t seq_ = 0;          ///< of the next message
};

}  // namespace panelgate::mqtt
