#pragma once

#include <boost/asio/awaitable.hpp>
#include <memory>
#include <string>
#include <string_view>

#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// An answer that is long and the same for all until it is made anew: its text, its tag and its
/// gzip are made once, and whoever asks is sent those.
class KeptAnswer {
  public:
    /// `content_type` lives as long as the program.
    KeptAnswer(std::string text, std::string_view content_type);

    /// With its ETag; 304 for who has it; packed for who takes that.
    static boost::asio::awaitable<HttpResponse> give(std::shared_ptr<KeptAnswer> self,
                                                     HttpRequest request);

  private:
    SharedText text_;
    SharedText packed_;  ///< null: nobody has asked for it yet
    std::string tag_;
    std::string_view content_type_;
};

}  // namespace panelgate::web
