#include "raycast.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace unimapper::simulator {
namespace {

constexpr std::size_t kPacket = 16;

std::array<float, 12> column_major(const Frame& frame, double scale) {
  std::array<float, 12> m{};
  const Vec3 columns[4] = {scale * frame.x, scale * frame.y, scale * frame.z, frame.origin};
  for (std::size_t i = 0; i < 4; ++i) {
    m[3 * i] = static_cast<float>(columns[i].x);
    m[3 * i + 1] = static_cast<float>(columns[i].y);
    m[3 * i + 2] = static_cast<float>(columns[i].z);
  }
  return m;
}

/// Embree reads 16 bytes per vertex, so the last one needs room behind it.
std::vector<float> padded(const std::vector<float>& positions) {
  std::vector<float> result(positions);
  result.push_back(0.0F);
  return result;
}

struct Buffers {
  std::vector<float> positions;
  const Mesh* mesh;
};

RTCGeometry make_geometry(RTCDevice device, const Buffers& buffers) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             buffers.positions.data(), 0, 3 * sizeof(float),
                             buffers.positions.size() / 3);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             buffers.mesh->indices.data(), 0, 3 * sizeof(std::uint32_t),
                             buffers.mesh->triangle_count());
  rtcCommitGeometry(geometry);
  return geometry;
}

}  // namespace

struct StaticScene::Data {
  const World* world = nullptr;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<Buffers> buffers;  // the static mesh, then prototypes
  std::vector<RTCScene> prototypes;
};

StaticScene::StaticScene(const World& world) : data_(std::make_unique<Data>()) {
  Data& d = *data_;
  d.world = &world;
  // A fixed number of builder threads: the tree must not depend on the machine's load or cores.
  d.device = rtcNewDevice("threads=2,set_affinity=0");
  if (d.device == nullptr) throw std::runtime_error("the ray caster (Embree) could not be started");
  d.buffers.push_back({padded(world.mesh.positions), &world.mesh});
  for (const Mesh& mesh : world.prototypes.meshes) {
    d.buffers.push_back({padded(mesh.positions), &mesh});
  }
  for (std::size_t i = 1; i < d.buffers.size(); ++i) {
    const RTCScene prototype = rtcNewScene(d.device);
    const RTCGeometry geometry = make_geometry(d.device, d.buffers[i]);
    rtcAttachGeometryByID(prototype, geometry, 0);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(prototype);
    d.prototypes.push_back(prototype);
  }
  d.scene = rtcNewScene(d.device);
  const RTCGeometry ground = make_geometry(d.device, d.buffers[0]);
  rtcAttachGeometryByID(d.scene, ground, 0);
  rtcReleaseGeometry(ground);
  unsigned int id = 1;
  for (const Instance& instance : world.instances) {
    const RTCGeometry geometry = rtcNewGeometry(d.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, d.prototypes[instance.prototype]);
    const auto transform = column_major(instance.frame, instance.scale);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.data());
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(d.scene, geometry, id++);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(d.scene);
  if (rtcGetDeviceError(d.device) != RTC_ERROR_NONE) {
    throw std::runtime_error("the ray caster (Embree) ran out of memory while building the scene");
  }
}

StaticScene::~StaticScene() {
  if (data_->scene != nullptr) rtcReleaseScene(data_->scene);
  for (const RTCScene prototype : data_->prototypes) rtcReleaseScene(prototype);
  if (data_->device != nullptr) rtcReleaseDevice(data_->device);
}

struct MovingScene::Data {
  const StaticScene::Data* standing = nullptr;
  RTCScene scene = nullptr;
  std::vector<MovingInstance> instances;
};

MovingScene::MovingScene(const StaticScene& prototypes) : data_(std::make_unique<Data>()) {
  data_->standing = prototypes.data_.get();
}

MovingScene::~MovingScene() {
  if (data_->scene != nullptr) rtcReleaseScene(data_->scene);
}

void MovingScene::set(std::vector<MovingInstance> instances) {
  Data& d = *data_;
  d.instances = std::move(instances);
  if (d.scene != nullptr) rtcReleaseScene(d.scene);
  d.scene = rtcNewScene(d.standing->device);
  unsigned int id = 0;
  for (const MovingInstance& instance : d.instances) {
    const RTCGeometry geometry = rtcNewGeometry(d.standing->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, d.standing->prototypes[instance.prototype]);
    rtcSetGeometryTimeStepCount(geometry, 2);
    const auto begin = column_major(instance.begin, instance.scale);
    const auto end = column_major(instance.end, instance.scale);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, begin.data());
    rtcSetGeometryTransform(geometry, 1, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, end.data());
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(d.scene, geometry, id++);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(d.scene);
}

namespace {

struct Target {
  const Mesh* mesh;
  const Frame* frame;  // null: the one large mesh
  std::uint16_t label, object;
};

RayHit make_hit(const RTCRayHit16& r, std::size_t i, const Target& target) {
  Vec3 normal{r.hit.Ng_x[i], r.hit.Ng_y[i], r.hit.Ng_z[i]};
  if (target.frame != nullptr) normal = target.frame->rotate(normal);
  const Vec3 direction{r.ray.dir_x[i], r.ray.dir_y[i], r.ray.dir_z[i]};
  const double length = norm(normal);
  const double cosine = length > 0.0 ? std::abs(dot(normal, direction)) / length : 0.0;
  const Surface surface = target.mesh->surfaces[r.hit.primID[i]];
  const std::uint16_t own = properties(surface).label;
  return {r.ray.tfar[i], static_cast<float>(cosine), surface,
          own == label::kOfObject ? target.label : own, target.object};
}

}  // namespace

void Caster::cast_packet(std::span<const RayQuery> queries, std::span<RayHit> hits) const {
  alignas(64) RTCRayHit16 r;
  alignas(64) int valid[kPacket];
  const std::size_t count = queries.size();
  for (std::size_t i = 0; i < kPacket; ++i) {
    const RayQuery& q = queries[std::min(i, count - 1)];
    valid[i] = i < count ? -1 : 0;
    r.ray.org_x[i] = static_cast<float>(q.origin.x);
    r.ray.org_y[i] = static_cast<float>(q.origin.y);
    r.ray.org_z[i] = static_cast<float>(q.origin.z);
    r.ray.dir_x[i] = static_cast<float>(q.direction.x);
    r.ray.dir_y[i] = static_cast<float>(q.direction.y);
    r.ray.dir_z[i] = static_cast<float>(q.direction.z);
    r.ray.tnear[i] = q.near_m;
    r.ray.tfar[i] = q.far_m;
    r.ray.time[i] = q.time;
    r.ray.mask[i] = 0xFFFFFFFFU;
    r.ray.id[i] = 0;
    r.ray.flags[i] = 0;
    r.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  const StaticScene::Data& standing = *standing_.data_;
  const World& world = *standing.world;
  rtcIntersect16(valid, standing.scene, &context, &r);
  for (std::size_t i = 0; i < count; ++i) {
    if (r.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
      hits[i] = {-1.0F, 0.0F, Surface::kRoad, 0, 0};
      continue;
    }
    Target target{&world.mesh, nullptr, 0, 0};
    if (r.hit.instID[0][i] != RTC_INVALID_GEOMETRY_ID) {
      const Instance& instance = world.instances[r.hit.instID[0][i] - 1];
      target = {&world.prototypes.meshes[instance.prototype], &instance.frame, instance.label,
                instance.object};
    }
    hits[i] = make_hit(r, i, target);
    r.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  const MovingScene::Data& moving = *moving_.data_;
  if (moving.instances.empty()) return;
  // Rays now end at static geometry, so only moving objects in front of it are found.
  rtcIntersect16(valid, moving.scene, &context, &r);
  for (std::size_t i = 0; i < count; ++i) {
    if (r.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    const MovingInstance& instance = moving.instances[r.hit.instID[0][i]];
    hits[i] = make_hit(r, i,
                       {&world.prototypes.meshes[instance.prototype], &instance.begin,
                        instance.label, instance.object});
  }
}

void Caster::cast(std::span<const RayQuery> queries, std::span<RayHit> hits) const {
  for (std::size_t i = 0; i < queries.size(); i += kPacket) {
    const std::size_t count = std::min(kPacket, queries.size() - i);
    cast_packet(queries.subspan(i, count), hits.subspan(i, count));
  }
}

}  // namespace unimapper::simulator
