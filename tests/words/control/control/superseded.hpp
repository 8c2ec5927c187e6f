// How far a witness sees?
struct Testimony {};
