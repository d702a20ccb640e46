#pragma once

#include <prometheus/metric_family.h>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/series.hpp"
#include "panelgate/metrics/exposition.hpp"

namespace panelgate::metrics {

using Labels = std::vector<prometheus::ClientMetric::Label>;

/// Takes families as they are made and hands on their text: one is in memory at a time. A family
/// without a metric has none.
class Families {
  public:
    explicit Families(const TakeText& take) : take_(take) {}

    void push_back(prometheus::MetricFamily family);
    /// Nobody wants the text any more: what is still to be made need not be.
    bool ended() const { return ended_; }

  private:
    const TakeText& take_;
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

/// Nothing when there is no HTTP server.
void add_http(Families& out, const Snapshot& snapshot);

/// Of the broker; nothing without one.
void add_mqtt(Families& out, const Snapshot& snapshot);

void add_points(Families& out, const Snapshot& snapshot);
void add_relays(Families& out, const Snapshot& snapshot);

/// Of masters on serial ports; nothing where there are none.
void add_serial_masters(Families& out, const Snapshot& snapshot);

}  // namespace panelgate::metrics
