// Instead of tls.cc where OpenSSL's headers were not installed. A configuration with a certificate
// is refused (server/net/certificate_without_openssl.cc), so nothing listens here.
#include "server/web/tls.h"

namespace pheromone::web {

class TlsListener::Impl {
 public:
  TlsCounters counters;
};

TlsListener::TlsListener(boost::asio::io_context& /*io*/, TlsOptions /*options*/, Give /*give*/)
    : impl_(std::make_shared<Impl>()) {}

TlsListener::~TlsListener() = default;

void TlsListener::SetCertificate(TlsContext /*context*/) {}

Status TlsListener::Listen() {
  return Error{"this program is built without TLS"};
}

void TlsListener::Stop() {}

uint16_t TlsListener::port() const {
  return 0;
}

const TlsCounters& TlsListener::counters() const {
  return impl_->counters;
}

}  // namespace pheromone::web
