#include "ports/keys/datagram_code.hpp"

#include <sodium.h>

#include "ports/keys/library.hpp"

namespace unimapper::keys {

static_assert(LinkSecret::size() == crypto_kdf_KEYBYTES);
static_assert(std::tuple_size_v<Code> >= crypto_generichash_BYTES_MIN);

namespace {

/// One step for each half of the boot id: libsodium's subkeys are numbered with 64 bits.
Secret<32> subkey(const Secret<32>& key, std::uint64_t number, const char* context) {
  Secret<32> sub;
  crypto_kdf_derive_from_key(sub.data(), Secret<32>::size(), number, context, key.data());
  return sub;
}

}  // namespace

DatagramCoder::DatagramCoder(const LinkSecret& secret, End end, const BootId& boot) {
  require_library();
  const char* context = end == End::kRobot ? "UMrobot1" : "UMbase_1";
  key_ = subkey(subkey(secret, boot.high, context), boot.low, context);
}

Code DatagramCoder::code(std::string_view channel, wire::Bytes datagram) const {
  crypto_generichash_state state;
  crypto_generichash_init(&state, key_.data(), Secret<32>::size(), std::tuple_size_v<Code>);
  // With its length: no channel and datagram are another channel and datagram put together.
  const auto length = static_cast<std::uint8_t>(channel.size());
  crypto_generichash_update(&state, &length, 1);
  crypto_generichash_update(&state, reinterpret_cast<const unsigned char*>(channel.data()), length);
  crypto_generichash_update(&state, datagram.data(), datagram.size());
  Code code;
  crypto_generichash_final(&state, code.data(), code.size());
  return code;
}

bool DatagramCoder::is_code(std::string_view channel, wire::Bytes datagram,
                            wire::Bytes code) const {
  const Code right = this->code(channel, datagram);
  return code.size() == right.size() && sodium_memcmp(code.data(), right.data(), right.size()) == 0;
}

}  // namespace unimapper::keys
