#include "server/robots/signing/fingerprint.h"

#include <algorithm>
#include <string_view>

#include "protocol/aes.h"
#include "server/robots/signing/evp_aes.h"

namespace pheromone::signing {

Fingerprint FingerprintOf(const Key& key) {
  constexpr std::string_view kText = "key fingerprint";
  MacKey mac_key;
  mac_key.Set(key.data());
  protocol::Cmac<EvpAes> cmac(&mac_key);
  for (const char c : kText) {
    cmac.Add(static_cast<uint8_t>(c));
  }
  std::array<uint8_t, protocol::kAesBlock> mac{};
  cmac.Finish(mac.data());
  Fingerprint fingerprint{};
  std::copy_n(mac.begin(), fingerprint.size(), fingerprint.begin());
  return fingerprint;
}

}  // namespace pheromone::signing
