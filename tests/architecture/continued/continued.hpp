// Doc comments and descriptions that do not stand alone
#pragma once

/// Where the comment of one member goes on:
struct Continued {
  float first_m = 0.0F;   ///< distance to the first wall,
  float second_m = 0.0F;  ///< likewise, but to the second one
  float third_m = 0.0F;   ///< of which the comment is longer than the line and so is continued
                          ///< on the next one;
  /// The same as before.
  float fourth_m = 0.0F;
  /// A block without a full stop
  float fifth_m = 0.0F;
  float origin_m = 0.0F; /**< and where it begins */
  /** Ends in a semicolon over
   *  two lines; */
  float end_m = 0.0F;
  /// A list:
  /// - a comma within one, (a bracket) and
  /// - a full stop at its end.
  float list_m = 0.0F;
};

consteval auto parameters_of(const Continued*) {
  return parameter_table(
      parameter<&Continued::first_m>("[0, 1)", "m", "choice", "Distance to the wall (the first),"),
      parameter<&Continued::second_m>("[0, 1)", "m", "choice",
                                      "and its growth with the path that lies behind, or "
                                      "ahead."),
      parameter<&Continued::third_m>("[0, 1)", "m", "choice", "Distance to a wall"),
      parameter<&Continued::list_m>("[0, 1)", "m", "choice", "Distance to a wall."));
}
