#include "trace_page.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace panelgate::web {
namespace {

template <class Entry>
std::uint64_t last_of(const std::vector<Entry>& entries) {
    return entries.empty() ? 0 : entries.back().sequence;
}

std::uint64_t last_number(const bus::TracePart& part) {
    return std::max({last_of(part.frames), last_of(part.decisions), last_of(part.transactions)});
}

template <class Entry>
void add_numbers(std::vector<std::uint64_t>& numbers, const std::vector<Entry>& entries) {
    for (const Entry& entry : entries) numbers.push_back(entry.sequence);
}

template <class Entry>
void cut_behind(std::vector<Entry>& entries, std::uint64_t last) {
    std::erase_if(entries, [last](const Entry& entry) { return entry.sequence > last; });
}

/// Leaves the oldest of all.
void cut(bus::TracePart& part, std::size_t most) {
    std::vector<std::uint64_t> numbers;
    add_numbers(numbers, part.frames);
    add_numbers(numbers, part.decisions);
    add_numbers(numbers, part.transactions);
    if (numbers.size() <= most || most == 0) return;
    std::ranges::sort(numbers);
    const std::uint64_t last = numbers[most - 1];
    cut_behind(part.frames, last);
    cut_behind(part.decisions, last);
    cut_behind(part.transactions, last);
}

}  // namespace

TracePage last_of_trace(const bus::BusClient& bus, std::size_t most) {
    TracePage page;
    page.part = bus.trace(most);
    page.next = last_number(page.part);
    return page;
}

TracePage trace_since(const bus::BusClient& bus, std::uint64_t since, std::size_t most) {
    TracePage page;
    page.part = bus.trace_since(since, most);
    cut(page.part, most);
    page.next = last_number(page.part);
    if (page.next == 0) page.next = std::min(since, last_of_trace(bus, 1).next);
    return page;
}

}  // namespace panelgate::web
