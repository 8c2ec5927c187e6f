// How far does a sensor see?
struct Range {};
