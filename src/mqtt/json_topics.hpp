#pragma once

#include "panelgate/mqtt/settings.hpp"
#include "panelgate/mqtt/subjects.hpp"

namespace panelgate::mqtt {

/// The JSON format: one retained topic per point, TOPIC/STATION/POINT. See docs/reference/mqtt.md.
class JsonTopics final : public MessageFormat {
  public:
    /// The subjects must outlive it.
    JsonTopics(const Settings& settings, const Subjects& subjects)
        : settings_(settings), subjects_(subjects) {}

    Message will() override;
    Message farewell(WallTime now) override;
    std::vector<std::string> subscriptions() const override;
    std::vector<std::string> retained() const override;
    std::size_t steps_before() const override { return 1; }
    std::size_t steps_behind() const override { return subjects_.size(); }
    std::optional<Message> before(std::size_t step, const States& states, std::uint64_t next_change,
                                  WallTime now) override;
    std::optional<Message> behind(std::size_t step, const States& states) override;
    std::optional<Message> change(const Change& change, const States& states,
                                  std::uint64_t next_change, WallTime now) override;
    std::vector<Command> commands(std::string_view topic, std::string_view payload,
                                  bool retained) const override;
    std::string topic_of(std::size_t point) const override;
    std::optional<Message> result(const WriteResult& result) const override;

  private:
    Message status(std::string payload) const;
    Message message(std::size_t subject, const State& state) const;
    std::string name_of(std::size_t subject) const;

    Settings settings_;
    const Subjects& subjects_;
};

}  // namespace panelgate::mqtt
