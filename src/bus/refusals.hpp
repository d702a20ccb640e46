#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <vector>

#include "answers.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::bus {

/// Refusals go out together, a millisecond apart: who asks again at once cannot keep the loop from
/// the wire (P4, P9). At most one waits a request that clients may have open.
class Refusals {
  public:
    Refusals(boost::asio::any_io_executor executor, rt::Clock& clock);
    /// Who still waits is told from the loop.
    ~Refusals();
    Refusals(const Refusals&) = delete;
    Refusals& operator=(const Refusals&) = delete;

    void add(Handed refused);

  private:
    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::vector<Handed> waiting_;
};

}  // namespace panelgate::bus
