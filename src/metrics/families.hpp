#pragma once

#include <prometheus/metric_family.h>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/series.hpp"
#include "panelgate/metrics/exposition.hpp"

namespace panelgate::metrics {

using Labels = std::vector<prometheus::ClientMetric::Label>;

/// Serializes each family as soon as it is added, so only one is in memory at a time. A family
/// without metrics produces no text.
class Families {
  public:
    explicit Families(const TextSink& take) : sink_(take) {}

    void push_back(prometheus::MetricFamily family);
    /// True once the receiver wants no more text; further families need not be made.
    bool ended() const { return ended_; }

  private:
    const TextSink& sink_;
    bool ended_ = false;
};

/// A family under construction. `help` must not contain backslashes or newlines: the serializer of
/// prometheus-cpp 1.0 does not escape them.
class Family {
  public:
    Family(std::string name, std::string help, prometheus::MetricType type);

    void counter(Labels labels, double value);
    void counter(Labels labels, std::uint64_t value) {
        counter(std::move(labels), static_cast<double>(value));
    }
    void gauge(Labels labels, double value);
    void histogram(Labels labels, const Histogram& histogram);

    prometheus::MetricFamily take() { return std::move(family_); }

  private:
    prometheus::ClientMetric& add(Labels labels);
    prometheus::MetricFamily family_;
};

Family make_counter(std::string name, std::string help);
Family make_gauge(std::string name, std::string help);
Family make_histogram(std::string name, std::string help);

/// Adds nothing if there is no HTTP server.
void add_tls(Families& out, const Snapshot& snapshot);
void add_http(Families& out, const Snapshot& snapshot);

/// Adds the MQTT families; nothing without a broker.
void add_mqtt(Families& out, const Snapshot& snapshot);
void add_audit(Families& out, const Snapshot& snapshot);
void add_alarms(Families& out, const Snapshot& snapshot);
void add_store(Families& out, const Snapshot& snapshot);

void add_points(Families& out, const Snapshot& snapshot);
void add_relays(Families& out, const Snapshot& snapshot);

/// Adds the families of serial masters; nothing if there are none.
void add_serial_masters(Families& out, const Snapshot& snapshot);

}  // namespace panelgate::metrics
