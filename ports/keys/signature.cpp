#include "ports/keys/signature.hpp"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

#include "ports/keys/library.hpp"
#include "src/wire/signed_keyframe.hpp"

namespace unimapper::keys {

static_assert(crypto_sign_BYTES == wire::kSignatureBytes);
static_assert(Secret<64>::size() == crypto_sign_SECRETKEYBYTES);
static_assert(SigningSeed::size() == crypto_sign_SEEDBYTES);
static_assert(sizeof(VerifyingKey) == crypto_sign_PUBLICKEYBYTES);

namespace {

/// What is signed: a hash, because Ed25519 reads its message twice, and a name of this use of the
/// key.
constexpr std::string_view kUse = "UMKFsig1";
using Digest = std::array<std::uint8_t, kUse.size() + crypto_generichash_BYTES_MAX>;

Digest digest_of(wire::Bytes keyframe) {
  Digest digest;
  std::copy(kUse.begin(), kUse.end(), digest.begin());
  crypto_generichash(digest.data() + kUse.size(), crypto_generichash_BYTES_MAX, keyframe.data(),
                     keyframe.size(), nullptr, 0);
  return digest;
}

}  // namespace

KeyframeSigner::KeyframeSigner(const RobotKey& key) {
  require_library();
  VerifyingKey verifying;
  crypto_sign_seed_keypair(verifying.data(), secret_.data(), key.seed.data());
}

void KeyframeSigner::sign(std::vector<std::uint8_t>& keyframe) const {
  if (!wire::split_signature(keyframe).signature.empty()) {
    throw std::invalid_argument("a keyframe is signed once");
  }
  const Digest digest = digest_of(keyframe);
  std::array<std::uint8_t, crypto_sign_BYTES> signature;
  crypto_sign_detached(signature.data(), nullptr, digest.data(), digest.size(), secret_.data());
  keyframe.insert(keyframe.end(), signature.begin(), signature.end());
  for (unsigned shift = 0; shift < 32; shift += 8) {
    keyframe.push_back(static_cast<std::uint8_t>(wire::kSignatureMagic >> shift));
  }
}

bool is_signed_by(const VerifyingKey& key, wire::Bytes keyframe) {
  require_library();
  const wire::SignedKeyframe parts = wire::split_signature(keyframe);
  if (parts.signature.empty()) return false;
  const Digest digest = digest_of(parts.keyframe);
  return crypto_sign_verify_detached(parts.signature.data(), digest.data(), digest.size(),
                                     key.data()) == 0;
}

}  // namespace unimapper::keys
