#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::web {

/// Who asks over one connection. Shared by the session and by what works for it; one thread.
class Caller {
  public:
    /// `id` is of this connection alone; `address` has no port, "" when it is not known.
    Caller(std::uint64_t id, std::string address) : id_(id), address_(std::move(address)) {}

    std::uint64_t id() const { return id_; }
    const std::string& address() const { return address_; }
    /// What people are told of it: "http 10.0.0.9", "http 10.0.0.9 token ops".
    std::string name() const {
        std::string text = "http";
        if (!address_.empty()) text += ' ' + address_;
        if (!token_.empty()) text += " token " + token_;
        return text;
    }
    /// The name of the token that its request of now carries; "" for none.
    void uses_token(std::string token) { token_ = std::move(token); }
    const std::string& token() const { return token_; }
    /// The connection is over: nobody waits for an answer, and what the site is made of may be
    /// gone.
    bool has_left() const { return left_; }
    /// What is called once when the connection is over. Of several for one `whom` the first counts;
    /// was this the first? Nothing may be asked of a caller that has left.
    bool at_leaving(const void* whom, std::function<void()> farewell) {
        return farewells_.emplace(whom, std::move(farewell)).second;
    }
    void forget(const void* whom) { farewells_.erase(whom); }
    /// Whoever is to be told when this one leaves is told when the other one does.
    void hand_over(Caller& to) { to.farewells_.merge(farewells_); }
    void leave() {
        left_ = true;
        hang_up();
    }
    /// Nobody waits for an answer, but what has begun is still wanted to its end: nothing that has
    /// not yet begun is.
    void hang_up() {
        hung_up_ = true;
        for (const auto& [whom, farewell] : std::exchange(farewells_, {})) farewell();
    }
    bool has_hung_up() const { return hung_up_; }
    /// Something came, or may have come, of what it asked for: asked again, it could come twice.
    void take_effect() { has_effect_ = true; }
    bool has_effect() const { return has_effect_; }
    /// A transaction was made for its request of now, by this line. Bounded: the first kMostCosts
    /// are known.
    struct Cost {
        const void* line = nullptr;
        std::uint64_t transaction = 0;
        friend bool operator==(const Cost&, const Cost&) = default;
    };
    static constexpr std::size_t kMostCosts = 1000;
    void add_cost(const Cost& cost) {
        if (costs_.size() < kMostCosts) costs_.push_back(cost);
    }
    /// Of its request of now, in their order; the next one begins with none.
    std::vector<Cost> take_costs() { return std::exchange(costs_, {}); }

  private:
    std::uint64_t id_;
    std::string address_;
    std::string token_;
    bool left_ = false;
    bool hung_up_ = false;
    bool has_effect_ = false;
    std::vector<Cost> costs_;
    std::map<const void*, std::function<void()>> farewells_;
};

}  // namespace panelgate::web
