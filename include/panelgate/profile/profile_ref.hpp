#pragma once

#include <memory>
#include <utility>

#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// A profile, and what keeps it: whoever holds this may outlive the configuration that it is of.
/// Without an owner it is a plain pointer.
class ProfileRef {
  public:
    ProfileRef(const PanelProfile* profile = nullptr, std::shared_ptr<const void> owner = {})
        : profile_(std::move(owner), profile) {}

    operator const PanelProfile*() const { return profile_.get(); }
    const PanelProfile& operator*() const { return *profile_; }
    const PanelProfile* operator->() const { return profile_.get(); }
    /// The very same; equal ones of two configurations are not.
    friend bool operator==(const ProfileRef& one, const ProfileRef& other) {
        return one.profile_.get() == other.profile_.get();
    }
    friend bool operator==(const ProfileRef& one, const PanelProfile* other) {
        return one.profile_.get() == other;
    }

  private:
    std::shared_ptr<const PanelProfile> profile_;
};

}  // namespace panelgate::profile
