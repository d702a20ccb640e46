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

/// Like std::function, but stores the callable inline, never on the heap: one larger than Size
/// bytes does not compile. Calling an empty InlineFunction breaks the caller's contract.
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
        ::new (static_cast<void*>(storage_)) Held(std::forward<F>(what));
        verbs_ = &kVerbs<Held>;
    }
    InlineFunction(const InlineFunction& other) : verbs_(other.verbs_) {
        if (verbs_ != nullptr) verbs_->copy(other.storage_, storage_);
    }
    InlineFunction(InlineFunction&& other) noexcept : verbs_(std::exchange(other.verbs_, nullptr)) {
        if (verbs_ != nullptr) verbs_->move(other.storage_, storage_);
    }
    InlineFunction& operator=(InlineFunction other) noexcept {
        clear();
        verbs_ = std::exchange(other.verbs_, nullptr);
        if (verbs_ != nullptr) verbs_->move(other.storage_, storage_);
        return *this;
    }
    ~InlineFunction() { clear(); }

    R operator()(Args... args) const { return verbs_->call(storage_, std::forward<Args>(args)...); }
    explicit operator bool() const { return verbs_ != nullptr; }

  private:
    struct Verbs {
        R (*call)(std::byte* held, Args&&... args);
        void (*copy)(const std::byte* from, std::byte* to);
        void (*move)(std::byte* from, std::byte* to) noexcept;  ///< destroys the object at `from`
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
        if (verbs_ != nullptr) std::exchange(verbs_, nullptr)->end(storage_);
    }

    alignas(std::max_align_t) mutable std::byte storage_[Size];
    const Verbs* verbs_ = nullptr;
};

}  // namespace panelgate
