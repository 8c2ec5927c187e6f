// Decimal numbers as text.
#include "unimapper/core/decimal.hpp"

#include <charconv>

#include "tests/test.hpp"

using namespace unimapper;

namespace {

float float_of_bits(std::uint32_t bits) {
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

}  // namespace

TEST_CASE("numbers are read as the standard library reads them") {
  for (const char* text : {"0", "-0.5", "10", "0.2", "1e-9", "16.81", "1E5", "2.5e+3", "4194304",
                           "123456789012345", "0.000012345"}) {
    double expected = 0.0;
    std::from_chars(text, text + std::strlen(text), expected);
    CAPTURE(text);
    REQUIRE(parse_decimal(text).has_value());
    CHECK(*parse_decimal(text) == expected);
  }
}

TEST_CASE("text that is not a number is refused") {
  for (const char* text : {"", "-", ".", "e5", "1e", "1e+", "1.2.3", "0x10", "nan", "inf", " 1",
                           "1 ", "+1", "1,5", "1e999", "--1"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_decimal(text).has_value());
  }
  CHECK(*parse_decimal("1e-999") == 0.0);
  CHECK(*parse_decimal("0e999") == 0.0);
}

TEST_CASE("numbers are written the shortest way") {
  CHECK(decimal_of(0.2F).view() == "0.2");
  CHECK(decimal_of(-0.05F).view() == "-0.05");
  CHECK(decimal_of(120.0F).view() == "120");
  CHECK(decimal_of(0.0F).view() == "0");
  CHECK(decimal_of(1e-9F).view() == "1e-9");
  CHECK(decimal_of(1.5e20F).view() == "1.5e20");
  CHECK(decimal_of(16.81).view() == "16.81");
  CHECK(decimal_of(4294967295U).view() == "4294967295");
  CHECK(decimal_of(0U).view() == "0");
  CHECK(decimal_of(std::numeric_limits<float>::quiet_NaN()).view() == "nan");
  CHECK(decimal_of(-std::numeric_limits<float>::infinity()).view() == "-inf");
}

TEST_CASE("every float reads back to the same bits") {
  std::mt19937 random(1);
  for (int i = 0; i < 200000; ++i) {
    // Parameters are nowhere near the ends of what a float holds.
    const float value = float_of_bits(static_cast<std::uint32_t>(random()));
    if (!(value > -1e15F && value < 1e15F) || (value > -1e-15F && value < 1e-15F)) continue;
    const DecimalText text = decimal_of(value);
    const auto back = parse_decimal(text.view());
    REQUIRE(back.has_value());
    if (static_cast<float>(*back) != value) FAIL(text.c_str());
  }
}

TEST_CASE("text beyond its capacity is left out and still ends in zero") {
  BoundedText<4> text;
  text.append("ab").append("cdef");
  CHECK(text.view() == "abc");
  CHECK(std::string(text.c_str()) == "abc");
  CHECK(text.full());
}
