// Tests of surfaces written with OpenMesh. Every list of faces must be accepted without aborting
// the process, although Debian builds OpenMesh with assertions. Decimation must preserve the
// properties of a surface.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>

#include "openmesh/polygons.h"
#include "openmesh/surface_file.h"

namespace shm::converters {
namespace {

struct Soup {
  std::vector<double> xyz;
  std::vector<std::uint64_t> face_begin{0};
  std::vector<std::uint32_t> corners, blocks;

  Surface surface() const {
    Surface all;
    all.xyz = std::as_bytes(std::span(xyz));
    all.face_begin = face_begin;
    all.corners = corners;
    all.blocks = blocks;
    return all;
  }
};

Soup random_soup(std::mt19937& numbers) {
  const auto random = [&](std::uint32_t most) {
    return static_cast<std::uint32_t>(numbers()) % most;
  };
  Soup soup;
  const std::uint32_t vertices = 3 + random(9), faces = 1 + random(40);
  // The mesh has few distinct points. Many faces therefore have no area or coincide with other
  // faces.
  for (std::uint32_t i = 0; i < 3 * vertices; ++i) soup.xyz.push_back(random(3));
  for (std::uint32_t f = 0; f < faces; ++f) {
    const std::uint32_t count = 1 + random(6);
    for (std::uint32_t i = 0; i < count; ++i) soup.corners.push_back(random(vertices));
    soup.face_begin.push_back(soup.corners.size());
    soup.blocks.push_back(random(4));
  }
  return soup;
}

std::uint32_t triangles_in(const std::vector<std::byte>& stl) {
  std::uint32_t count = 0;
  if (stl.size() >= 84) std::memcpy(&count, stl.data() + 80, sizeof count);
  return count;
}

TEST(SurfaceFile, WhateverComesIsWritten) {
  if (!can_write_surfaces()) GTEST_SKIP() << "built without OpenMesh";
  std::mt19937 numbers(11);
  for (int round = 0; round < 400; ++round) {
    const Soup soup = random_soup(numbers);
    for (const SurfaceFormat format :
         {SurfaceFormat::ply, SurfaceFormat::stl, SurfaceFormat::obj}) {
      const auto polygons = polygons_of(soup.surface(), {format == SurfaceFormat::stl});
      ASSERT_TRUE(polygons);
      MemorySink file;
      const auto written = write_surface(soup.surface(), {.format = format}, file);
      ASSERT_TRUE(written) << written.error().message();
      EXPECT_EQ(written->faces, polygons->face_count());
      EXPECT_EQ(written->vertices, polygons->vertices.size());
      if (format == SurfaceFormat::stl) {
        EXPECT_EQ(triangles_in(file.bytes), written->faces);
        EXPECT_EQ(file.bytes.size(), 84 + 50 * written->faces);
      }
    }
  }
}

TEST(SurfaceFile, WhateverComesIsDecimated) {
  if (!can_write_surfaces()) GTEST_SKIP() << "built without OpenMesh";
  std::mt19937 numbers(12);
  for (int round = 0; round < 400; ++round) {
    const Soup soup = random_soup(numbers);
    for (const std::uint64_t left : {1, 5, 1000}) {
      std::array<MemorySink, 2> files;
      for (MemorySink& file : files) {
        const auto written =
            write_surface(soup.surface(), {.format = SurfaceFormat::stl, .decimate = left}, file);
        ASSERT_TRUE(written) << written.error().message();
        EXPECT_LE(written->faces, written->triangles_before);
        EXPECT_EQ(triangles_in(file.bytes), written->faces);
      }
      EXPECT_EQ(files[0].bytes, files[1].bytes);
    }
  }
}

TEST(SurfaceFile, WhatASinkRefusesIsAnError) {
  if (!can_write_surfaces()) GTEST_SKIP() << "built without OpenMesh";
  class Full final : public ByteSink {
   public:
    Result<void> write(std::span<const std::byte>) override {
      return Error{ErrorCode::output, "no room", {}, kNoOffset, {}};
    }
  };
  std::mt19937 numbers(13);
  const Soup soup = random_soup(numbers);
  for (const SurfaceFormat format : {SurfaceFormat::ply, SurfaceFormat::stl, SurfaceFormat::obj}) {
    Full full;
    const auto written = write_surface(soup.surface(), {.format = format}, full);
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::output);
    EXPECT_EQ(written.error().detail, "no room");
  }
}

TEST(SurfaceFile, ColoursArePlys) {
  if (!can_write_surfaces()) GTEST_SKIP() << "built without OpenMesh";
  std::mt19937 numbers(14);
  const Soup soup = random_soup(numbers);
  const std::vector<Rgb> colours(soup.blocks.size());
  const SurfaceColours coloured{false, colours};
  MemorySink file;
  const auto written =
      write_surface(soup.surface(), {.format = SurfaceFormat::obj, .colours = &coloured}, file);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::misuse);
}

}  // namespace
}  // namespace shm::converters
