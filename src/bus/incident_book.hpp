#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/wall_time.hpp"
#include "panelgate/bus/trace.hpp"
#include "trace_store.hpp"

namespace panelgate::bus {

/// Something went wrong on the line.
struct Trouble {
    TimePoint at;
    WallTime time{};
    std::optional<std::uint8_t> station{};  ///< nothing: the whole line
    std::string_view cause;                 ///< a literal
    bool news = true;  ///< false: it goes on as it did, and is no incident of its own
};

/// Keeps what happened around errors, the last of them, in memory of a fixed size: what stood in
/// the trace before the first, and what came behind the last. Pure.
class IncidentBook {
  public:
    explicit IncidentBook(const IncidentSettings& settings) : settings_(settings) {}

    /// `trace`: of the line, with what went wrong.
    void on_trouble(const Trouble& trouble, const TraceStore& trace);
    // What happens on the line, as it is recorded there: it belongs to the incident that is open.
    void begin(const RecordedTransaction& transaction);
    void add(const RecordedFrame& frame, ByteView bytes);
    void add(const RecordedDecision& decision, std::string_view text);
    void update(const RecordedTransaction& transaction);
    /// A transaction is over.
    void end(const RecordedTransaction& transaction);

    /// The oldest first.
    std::vector<IncidentHead> heads() const;
    /// One of them, which has been read then.
    std::optional<Incident> fetch(std::uint64_t id);

  private:
    struct Kept {
        IncidentHead head;
        TraceStore store;
    };
    void open(const Trouble& trouble, const TraceStore& trace);
    Kept& place();
    void close();

    IncidentSettings settings_;
    std::vector<std::unique_ptr<Kept>> kept_;  ///< the oldest first
    bool open_ = false;                        ///< the newest of them
    std::size_t left_ = 0;                     ///< transactions that still belong to it
    TimePoint until_{};                        ///< … and not later than this
    std::uint64_t count_ = 0;
};

}  // namespace panelgate::bus
