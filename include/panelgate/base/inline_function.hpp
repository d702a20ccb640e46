#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace panelgate {

template <class Signature, std::size_t Size>
class InlineFunction;

/// As std::function, but what it holds lies within it and never on the heap: whatever is larger
/// than Size bytes does not compile. To call an empty one breaks the caller's contract.
template <class R, class... Args, std::size_t Size>
class InlineFunction<R(Args...), Size> {
  public:
    InlineFunction() = default;
    InlineFunction(std::nullptr_t) {}  // NOLINT(*-explicit-*): as std::function
    template <class F>
        requires(!std::is_same_v<std::decay_t<F>, InlineFunction> &&
                 std::is_invocable_r_v<R, std::decay_t<F>&, Args...>)
    InlineFunction(F&& what) {  // NOLINT(*-explicit-*): as std::function
        using Held = std::decay_t<F>;
        static_assert(sizeof(Held) <= Size, "it captures more than fits");
        static_assert(alignof(Held) <= alignof(std::max_align_t));
        ::new (static_cast<void*>(room_)) Held(std::forward<F>(what));
        verbs_ = &kVerbs<Held>;
    }
    InlineFunction(const InlineFunction& other) : verbs_(other.verbs_) {
        if (verbs_ != nullptr) verbs_->copy(other.room_, room_);
    }
    InlineFunction(InlineFunction&& other) noexcept : verbs_(std::exchange(other.verbs_, nullptr)) {
        if (verbs_ != nullptr) verbs_->move(other.room_, room_);
    }
    InlineFunction& operator=(InlineFunction other) noexcept {
        clear();
        verbs_ = std::exchange(other.verbs_, nullptr);
        if (verbs_ != nullptr) verbs_->move(other.room_, room_);
        return *this;
    }
    ~InlineFunction() { clear(); }

    R operator()(Args... args) const { return verbs_->call(room_, std::forward<Args>(args)...); }
    explicit operator bool() const { return verbs_ != nullptr; }

  private:
    struct Verbs {
        R (*call)(std::byte* held, Args&&... args);
        void (*copy)(const std::byte* from, std::byte* to);
        void (*move)(std::byte* from, std::byte* to) noexcept;  ///< nothing is left at `from`
        void (*end)(std::byte* held) noexcept;
    };
    template <class Held>
    static Held* in(std::byte* room) {
        return std::launder(reinterpret_cast<Held*>(room));
    }
    template <class Held>
    static constexpr Verbs kVerbs = {
        [](std::byte* held, Args&&... args) -> R {
            return std::invoke(*in<Held>(held), std::forward<Args>(args)...);
        },
        [](const std::byte* from, std::byte* to) {
            ::new (static_cast<void*>(to)) Held(*std::launder(reinterpret_cast<const Held*>(from)));
        },
        [](std::byte* from, std::byte* to) noexcept {
            ::new (static_cast<void*>(to)) Held(std::move(*in<Held>(from)));
            std::destroy_at(in<Held>(from));
        },
        [](std::byte* held) noexcept { std::destroy_at(in<Held>(held)); },
    };

    void clear() {
        if (verbs_ != nullptr) std::exchange(verbs_, nullptr)->end(room_);
    }

    alignas(std::max_align_t) mutable std::byte room_[Size];
    const Verbs* verbs_ = nullptr;
};

}  // namespace panelgate
