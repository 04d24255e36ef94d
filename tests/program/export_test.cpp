#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "program.h"
#include "sim/log/pose_log.h"
#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using testing::HasSubstr;

class Export : public Program {
 protected:
  struct Glb {
    Json json;
    std::string binary;

    std::vector<float> floats(int accessor) const {
      const Json& a = json["accessors"][static_cast<std::size_t>(accessor)];
      const Json& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
      std::vector<float> values(view["byteLength"].get<std::size_t>() / 4);
      std::memcpy(values.data(), binary.data() + view["byteOffset"].get<std::size_t>(), values.size() * 4);
      return values;
    }
  };

  static std::uint32_t number(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  }

  Glb read(const std::string& file) const {
    const std::string bytes = content(file);
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(number(bytes, 8), bytes.size());
    const std::uint32_t length = number(bytes, 12);
    EXPECT_EQ(number(bytes, 20 + length), bytes.size() - 28 - length);
    return {Json::parse(bytes.substr(20, length)), bytes.substr(28 + length)};
  }
};

/// Returns the example with all properties of a material, under a spot light.
Json textured_example() {
  return test::edited(R"(
    /images = [{"uri": "data:image/png;base64,iVBORw0KGgo="}];
    /samplers = [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9986}];
    /textures = [{"source": 0, "sampler": 0}];
    /materials/0 = {"alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [0.5, 1, 0.25],
      "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2}},
      "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform":
        {"offset": [0.1, 0.7], "rotation": 0.3, "scale": [2, -0.5]}}}}};
    /accessors/- = {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC2"};
    /meshes/0/primitives/0/attributes/TEXCOORD_0 = 2;
    /extensions/KHR_lights_punctual/lights/0 = {"type": "spot", "intensity": 20, "range": 9,
      "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}})");
}

TEST_F(Export, GlbHasPosesAsKeys) {
  printed("run $S/rod_chain.gltf --algorithm a5 --duration 0.5 --output a.poses.txt");
  expect("export a.poses.txt --scene $S/rod_chain.gltf --rate 30", 0,
         {"wrote a.glb: 16 frames, 0.0333333 s apart, the last at 0.5 s"});
  const Glb glb = read("a.glb");
  const PoseLog log = read_pose_log(folder() / "a.poses.txt");

  ASSERT_EQ(glb.json["animations"].size(), 1u);
  const Json& animation = glb.json["animations"][0];
  ASSERT_EQ(animation["channels"].size(), 6u);  // three rods move and turn
  for (const Json& channel : animation["channels"]) {
    const Json& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
    const std::vector<float> times = glb.floats(sampler["input"]);
    ASSERT_EQ(times.size(), 16u);
    EXPECT_FLOAT_EQ(times.back(), 0.5F);
    const std::string name = glb.json["nodes"][channel["target"]["node"].get<std::size_t>()]["name"];
    const auto body = static_cast<std::size_t>(std::ranges::find(log.bodies, name) - log.bodies.begin());
    ASSERT_LT(body, log.bodies.size()) << name;
    const std::vector<float> keys = glb.floats(sampler["output"]);
    const bool is_turn = channel["target"]["path"] == "rotation";
    ASSERT_EQ(keys.size(), is_turn ? 64u : 48u);
    for (std::size_t k = 0; k < 16; ++k) {
      const Coordinates& q = log.frames[2 * k].poses[body];
      if (is_turn) {
        const Eigen::Vector4f key(&keys[4 * k]);
        EXPECT_NEAR(std::abs(key.dot(q.angular.coeffs().cast<float>())), 1, 1e-6);
        if (k > 0) {
          EXPECT_GT(key.dot(Eigen::Vector4f(&keys[4 * k - 4])), 0);
        }
      } else {
        EXPECT_LT((Eigen::Vector3f(&keys[3 * k]) - q.linear.cast<float>()).norm(), 1e-6);
      }
    }
  }
  EXPECT_EQ(glb.json["cameras"].size(), 1u);
  EXPECT_EQ(glb.json["extensions"]["KHR_lights_punctual"]["lights"].size(), 1u);
}

TEST_F(Export, SharesMeshesAndRefusesBadNames) {
  printed("export $S/box_pyramid.gltf --duration 0 --output p.glb");
  const Glb glb = read("p.glb");
  EXPECT_GT(glb.json["nodes"].size(), 50u);
  EXPECT_LT(glb.json["meshes"].size(), 12u);
  EXPECT_FALSE(glb.json.contains("animations"));
  refuses("export $S/pendulum.gltf --output p.obj", "p.obj: give a name that ends in .glb");
  refuses("export $S/pendulum.gltf --output missing/p.glb", "there is no folder missing");
}

TEST_F(Export, KeepsMaterialsAndLights) {
  write("crate.gltf", textured_example().dump());
  printed("export crate.gltf --duration 0 --output again.glb");
  const Glb glb = read("again.glb");
  // Returns true where `json` has all members of `part`.
  const auto has = [](const Json& json, const char* part) {
    Json merged = json;
    merged.merge_patch(Json::parse(part));
    return merged == json;
  };
  ASSERT_EQ(glb.json["images"].size(), 1u);
  ASSERT_EQ(glb.json["textures"].size(), 1u);
  EXPECT_TRUE(has(glb.json["samplers"][0],
                  R"({"wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9986})"));
  const Json& materials = glb.json["materials"];
  const auto found = std::ranges::find_if(materials, [](const Json& m) { return m.contains("alphaMode"); });
  ASSERT_NE(found, materials.end());
  EXPECT_TRUE(has(*found, R"({"alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": false,
                              "emissiveFactor": [0.5, 1, 0.25],
                              "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2.0}}})"))
      << *found;
  const Json& color = (*found)["pbrMetallicRoughness"]["baseColorTexture"];
  const Json& transform = color["extensions"]["KHR_texture_transform"];
  EXPECT_EQ(color["texCoord"], 0);
  EXPECT_NEAR(transform["rotation"], 0.3, 1e-12);
  EXPECT_NEAR(transform["scale"][0], 2, 1e-12);
  EXPECT_NEAR(transform["scale"][1], -0.5, 1e-12);
  EXPECT_EQ(transform["offset"], Json({0.1, 0.7}));
  const Json& lights = glb.json["extensions"]["KHR_lights_punctual"]["lights"];
  ASSERT_EQ(lights.size(), 1u);
  EXPECT_TRUE(has(lights[0], R"({"type": "spot", "intensity": 20, "range": 9,
                                 "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}})"));
  for (const char* const extension :
       {"KHR_texture_transform", "KHR_materials_emissive_strength", "KHR_lights_punctual"})
    EXPECT_THAT(glb.json["extensionsUsed"], testing::Contains(extension));
}

using Player = Program;

TEST_F(Player, NeedsNoOtherFile) {
  const std::string words = "player $S/rod_chain.gltf --duration 0.2 --title '</script><a>' --output a.html";
  expect(words, 0, {"wrote a.html"});
  EXPECT_EQ(files(), std::vector<std::string>{"a.html"});
  const std::string page = content("a.html");
  expect_content("a.html", {"<h1>&lt;/script&gt;&lt;a&gt;</h1>", "\"name\":\"Reference\""},
                 {"://", "</script><a>", "{{", "src=", "href=\""});
  printed(words);
  EXPECT_EQ(content("a.html"), page);
}

TEST_F(Player, KeepsSixPanelsOfFiveSecondsSmall) {
  printed(
      "player $S/dominoes.gltf --output a.html --no-reference --duration 5 --panel a5,n=1 --panel a5,n=2 "
      "--panel a5,n=3 --panel a5,n=4 --panel a5,n=5 --panel a5,n=6");
  // Measured 460 kB; the largest page, of box_pyramid, has 2.6 MB.
  EXPECT_LT(content("a.html").size(), 1'000'000u);
}

class Site : public Program {
 protected:
  Outcome make(const std::string& scenes) const {
    return shell("player " + scenes +
                 " --panel a5 --duration 0.1 --reference-substeps 2 --title 'a <site>' --output site");
  }
};

TEST_F(Site, ShowsGoodScenesAndNamesBadOnes) {
  copy_scene("pendulum.gltf", "a b&c.gltf");
  copy_scene("rod_chain.gltf", "chain.gltf");
  write("a b&c.md",
        "# A <b>pendulum</b>\n\nSee [the chain](chain.md), [itself](<a b&c.md>), "
        "[its code](../sim/a5_havok.cpp), "
        "[bad](javascript:alert(1)).\n\n<!-- a note -->\n| a | b |\n|---|---|\n| <script>x</script> | 2 |\n");
  write("bad.gltf", "{}");
  const Outcome outcome = make("'a b&c.gltf' bad.gltf chain.gltf");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("substep: bad.gltf: "));
  EXPECT_THAT(outcome.err, HasSubstr("1 scene could not be shown"));
  EXPECT_THAT(outcome.out, HasSubstr("wrote site/index.html: 2 of 3 scenes"));
  EXPECT_THAT(files(),
              testing::IsSupersetOf({"site/index.html", "site/a b&c/index.html", "site/a b&c/player.html",
                                     "site/a b&c/poster.png", "site/chain/index.html"}));
  expect_content("site/index.html", {"<h1>a &lt;site&gt;</h1>", "<a href=\"a%20b%26c/index.html\">",
                                     "A &lt;b&gt;pendulum&lt;/b&gt;"});
  expect_content(
      "site/a b&c/index.html",
      {"<a href=\"../chain/index.html\">the chain</a>", "<a href=\"../a%20b%26c/index.html\">itself</a>",
       "<a>its code</a>", "<td>&lt;script&gt;x&lt;/script&gt;</td>", ">A5  n=10 m=1 "},
      {"javascript:", "a note", "<script>"});
}

TEST_F(Site, OverwritesOnlyItselfAndRefusesBadScenes) {
  copy_scene("pendulum.gltf", "a.gltf");
  std::filesystem::create_directory(folder() / "site");
  write("site/mine.txt", "mine");
  EXPECT_THAT(make("a.gltf").err, HasSubstr("site: holds what is no site of 'substep player'"));
  std::filesystem::remove(folder() / "site/mine.txt");
  EXPECT_EQ(make("a.gltf").exit_code, 0);
  write("site/a/old.txt", "of an earlier version");
  EXPECT_EQ(make("a.gltf").exit_code, 0);
  EXPECT_FALSE(has("site/a/old.txt"));
  EXPECT_THAT(make("a.gltf --scale 2").err, HasSubstr("a.gltf: is a scene"));
  EXPECT_THAT(make("a.gltf $S/pendulum.gltf a.gltf").err, HasSubstr("another scene has the name a"));
}

}  // namespace
}  // namespace substep
