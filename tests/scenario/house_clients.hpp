#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <vector>

#include "agenda.hpp"
#include "house_plan.hpp"
#include "house_questions.hpp"
#include "house_seam.hpp"
#include "pipeline.hpp"
#include "random.hpp"
#include "shared.hpp"

namespace panelgate::scenario {

/// Modbus/TCP clients at the seam between a session's socket and its pipeline: whole ADUs in, the
/// ADUs of replies out. Each keeps some requests open, takes its replies when it likes, and may
/// leave at any moment.
class HouseClients {
  public:
    /// As soon as the process runs.
    using Reach = std::function<void(std::function<void()>)>;

    HouseClients(const HousePlan& plan, Agenda& agenda, Random& random, Questions& questions,
                 HouseJudge& judge, std::shared_ptr<tcp_server::Shared> shared, Reach reach)
        : plan_(plan),
          agenda_(agenda),
          random_(random),
          questions_(questions),
          judge_(judge),
          shared_(std::move(shared)),
          reach_(std::move(reach)) {}

    void start();
    /// They ask for nothing more.
    void end() { ended_ = true; }
    /// Each has all its replies.
    bool idle() const;

  private:
    struct Asked {
        HouseJudge::Question question;
        std::uint16_t transaction = 0;
    };
    struct Client {
        ClientPlan plan;
        std::shared_ptr<tcp_server::Pipeline> pipeline;
        std::deque<Asked> open;
        std::uint16_t transaction = 0;
        unsigned scanned = 0;
        bool taking = false;
    };
    void connect(Client& client);
    void ask(Client& client);
    void take_soon(Client& client);
    void take(Client& client);
    void judge(Client& client, const Bytes& adu);
    void leave(Client& client);
    void leave_some_time(Client& client);
    std::uint8_t draw_unit(Client& client);
    Bytes draw_read(const Client& client);

    const HousePlan& plan_;
    Agenda& agenda_;
    Random& random_;
    Questions& questions_;
    HouseJudge& judge_;
    std::shared_ptr<tcp_server::Shared> shared_;
    Reach reach_;
    std::list<Client> clients_;
    unsigned connections_ = 0;
    bool ended_ = false;
};

}  // namespace panelgate::scenario
