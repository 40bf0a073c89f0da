// GLSL 3.30, of which all but the wireframe is GLSL ES 3.00, too. A program is compiled for each shading, in variants
// by the definitions REGIONS, LAYERS, SHADOWS, PATTERN_PER_PIXEL and SECTION (gl_program.h): a software rasteriser
// runs both branches of an `if`. All lighting is in view space, in linear light, with lamps fixed to the camera.
#pragma once

namespace sectio::shaders {

#ifdef __EMSCRIPTEN__
constexpr const char* kVersion =
    "#version 300 es\nprecision highp float;\nprecision highp int;\n"
    "precision highp sampler3D;\nprecision highp usampler3D;\n";
#else
constexpr const char* kVersion = "#version 330 core\n";
#endif

constexpr const char* kAttributes = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 rest_depth;
layout(location = 3) in vec4 vertex_pattern;
layout(location = 4) in float vertex_scalar;
uniform mat4 view_from_mesh;
uniform mat4 projection;
invariant gl_Position;
out vec3 p_view;
void put_vertex() {
  vec4 p = view_from_mesh * vec4(position, 1.0);
  p_view = p.xyz;
  gl_Position = projection * p;
}
)";

constexpr const char* kVertex = R"(
out vec3 n_view;
out vec4 rest;
out vec4 pattern;
out float scalar;
void main() {
  put_vertex();
  n_view = mat3(view_from_mesh) * normal;
  rest = rest_depth;
  pattern = vertex_pattern;
  scalar = vertex_scalar;
})";

constexpr const char* kLamps = R"(
const vec3 kKey = vec3(-0.4082, 0.8165, 0.4082);
const vec3 kFill = vec3(0.7682, 0.0960, 0.6330);
const vec3 kRim = vec3(0.3015, 0.6030, -0.7385);

// The colour on the screen. Filmic curve: Narkowicz 2015, ACES filmic tone mapping. Display gamma is taken as 2.
vec3 shown(vec3 light) {
  light *= 0.85;
  return sqrt(clamp(light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14), 0.0, 1.0));
}
)";

constexpr const char* kKeyLight = R"(
in vec3 p_view;
out vec4 fragment;
#ifdef SHADOWS
uniform vec4 occluder_from[2];
uniform vec4 occluder_to[2];
uniform int occluder_count;
#endif

// Share of the key light that passes the instruments. The penumbra widens with the distance of what throws it.
float key_light_at(vec3 p) {
  float light = 1.0;
#ifdef SHADOWS
  for (int i = 0; i < occluder_count; ++i) {
    vec3 ab = occluder_to[i].xyz - occluder_from[i].xyz;
    vec3 ap = p - occluder_from[i].xyz;
    float along = dot(ab, kKey);
    float height = dot(ap, kKey);
    float s = clamp((dot(ap, ab) - height * along) / max(dot(ab, ab) - along * along, 1e-10), 0.0, 1.0);
    float t = max(s * along - height, 0.0);
    float gap = length(ap + t * kKey - s * ab);
    float radius = mix(occluder_from[i].w, occluder_to[i].w, s);
    float soft = 0.0006 + 0.07 * t;
    light -= min(1.5 * radius / soft, 1.0) * (1.0 - smoothstep(radius - soft, radius + soft, gap));
  }
#endif
  return max(light, 0.0);
}
)";

constexpr const char* kLighting = R"(
in vec3 n_view;
in vec4 rest;
in vec4 pattern;
in float scalar;
uniform vec3 base_colour;
uniform sampler3D noise;
uniform sampler3D relief;

// A room with a bright square lamp above left and a grey floor, as a mirror direction sees it.
vec3 surroundings(vec3 r) {
  float sky = smoothstep(-0.3, 1.0, r.y);
  float lamp = smoothstep(0.86, 0.97, dot(r, kKey));
  float window = smoothstep(0.80, 0.95, dot(r, kFill));
  return mix(vec3(0.06, 0.055, 0.05), vec3(0.42, 0.45, 0.50), sky) + lamp * vec3(3.2, 3.1, 2.9) +
         window * vec3(0.55, 0.60, 0.70);
}

float lobe(float cosine, float sharpness) { return exp2(sharpness * (cosine - 1.0)); }

// The normal of a surface that a height field has been added to, given its gradient over rest coordinates. Slopes are
// taken on the screen, so no tangent frame is needed. Mikkelsen 2010, Bump mapping unparametrized surfaces on the GPU.
vec3 bumped(vec3 n, vec3 gradient) {
  vec3 dx = dFdx(p_view), dy = dFdy(p_view);
  vec3 rx = cross(dy, n), ry = cross(n, dx);
  float area = dot(dx, rx);
  vec3 slope = sign(area) * (dot(gradient, dFdx(rest.xyz)) * rx + dot(gradient, dFdy(rest.xyz)) * ry);
  return normalize(max(abs(area), 1e-12) * n - slope);
}

void emit(vec3 light) { fragment = vec4(shown(light), 1.0); }

// Diffuse light under a moist film. Red travels farther in tissue, so it wraps farther round the terminator.
void emit_tissue(vec3 n, vec3 film_n, vec3 albedo, float ambient, float wetness) {
  vec3 v = normalize(-p_view);
  float key = key_light_at(p_view);
  const vec3 wrap = vec3(0.30, 0.12, 0.08);
  vec3 diffuse = key * 0.95 * vec3(1.0, 0.98, 0.95) * max((dot(n, kKey) + wrap) / (1.0 + wrap), 0.0);
  diffuse += 0.22 * vec3(0.85, 0.92, 1.0) * max((dot(n, kFill) + wrap) / (1.0 + wrap), 0.0);
  // An instrument that takes the key light takes some of the sky, too.
  diffuse += ambient * mix(0.6, 1.0, key) * mix(vec3(0.17, 0.14, 0.13), vec3(0.23, 0.24, 0.27), 0.5 + 0.5 * n.y);
  vec3 colour = albedo * diffuse * mix(0.55, 1.0, ambient);

  float facing = max(dot(film_n, v), 0.0);
  float fresnel = 0.03 + 0.5 * exp2(-8.5 * facing);
  vec3 mirror = reflect(-v, film_n);
  float key_part = mix(0.25, 1.0, key);
  colour += wetness * ambient * fresnel * 0.7 * surroundings(mirror) * key_part;
  colour += wetness * key * (1.1 * lobe(dot(mirror, kKey), 260.0) + 0.10 * lobe(dot(mirror, kKey), 14.0));
  colour += wetness * 0.22 * lobe(dot(mirror, kFill), 90.0);
  colour += albedo * 0.5 * max(dot(n, kRim), 0.0) * (1.0 - facing);
  emit(colour);
}

// The scalar of skin and walls is wetness: a liquid film darkens what lies under it and shines.
float wet_shade() { return 1.0 - 0.35 * scalar; }
float wet_gloss() { return 1.2 * scalar; }
)";

// Tissue in front of a plane isn't there. A back face that can be seen is seen through the plane: it looks like the
// plane, with the regions of the body at rest. It keeps its own depth, so that front faces before it hide it.
constexpr const char* kSection = R"(
uniform vec4 section;
uniform vec3 inside_colour;
uniform mat4 rest_from_view;
bool drawn_as_section() {
  if (dot(section, vec4(p_view, 1.0)) > 0.0) discard;
  float along = -section.w / min(dot(section.xyz, p_view), -1e-9);
  if (gl_FrontFacing || along <= 0.0 || along >= 1.0) return false;
  vec4 place = vec4(along * p_view, 1.0);
  vec3 inside = (rest_from_view * place).xyz;
  vec4 coarse = textureLod(noise, inside * 23.0 + 0.11, 0.0);
  vec4 fine = textureLod(relief, inside * 79.0, 0.0);
  vec3 albedo = inside_colour * inside_colour * (0.50 + 0.62 * coarse.r) * (0.66 + 0.60 * fine.a);
#ifdef REGIONS
  albedo = tissue_at(inside, albedo, smoothstep(0.30, 0.80, coarse.r), 0.68 + 0.54 * fine.a);
#endif
  emit(albedo * (0.45 + 0.6 * max(dot(section.xyz, kKey), 0.0) + 0.3 * max(dot(section.xyz, kFill), 0.0)));
  return true;
}
)";

// The broad pattern varies so slowly that fine meshes carry it on their vertices: a look-up costs as much as the light.
constexpr const char* kSkin = R"(
void main() {
#ifdef SECTION
  if (drawn_as_section()) return;
#endif
  vec3 n = normalize(n_view);
#ifdef PATTERN_PER_PIXEL
  vec4 broad = texture(noise, rest.xyz * 9.0 + 0.37);
#else
  vec4 broad = pattern;
#endif
  vec4 fine = texture(relief, rest.xyz * 41.0);
  vec3 albedo = base_colour * base_colour;
  albedo *= (0.66 + 0.68 * broad.r) * (0.80 + 0.34 * fine.a);
  albedo = mix(albedo, albedo * vec3(0.60, 0.42, 0.48), 0.55 * smoothstep(0.45, 0.95, broad.a));
  albedo = mix(albedo, vec3(dot(albedo, vec3(0.35))), 0.10 + 0.10 * broad.b);
#ifdef REGIONS
  albedo = tissue_at(rest.xyz, albedo, smoothstep(0.35, 0.75, broad.r), 0.80 + 0.34 * fine.a);
#endif
  vec3 film = bumped(n, 0.15 * (fine.rgb - 0.5));
  emit_tissue(mix(n, film, 0.5), film, albedo * wet_shade(), 1.0, 0.75 + 0.4 * broad.b + wet_gloss());
})";

// A scene with regions says what is inside: that is shown as it is, and only the light depends on the depth. Without
// regions a wall is parenchyma: red grains and paler septa, mouths of vessels, a pale capsule along the lip, and blood
// that gathers towards the bottom, where little light comes.
constexpr const char* kWall = R"(
#ifdef LAYERS
uniform vec4 layer[4];  // in linear light, and the depth to which each reaches
vec3 layer_at(float depth) {
  vec3 colour = layer[0].rgb;
  for (int i = 1; i < 4; ++i)
    colour = mix(colour, layer[i].rgb, smoothstep(layer[i - 1].w - 0.00015, layer[i - 1].w + 0.00015, depth));
  return colour;
}
#endif
void main() {
#ifdef SECTION
  if (drawn_as_section()) return;
#endif
  vec3 n = normalize(n_view);
  if (!gl_FrontFacing) n = -n;
  float depth = rest.w;
  vec4 coarse = texture(noise, rest.xyz * 23.0 + 0.11);
  vec4 fine = texture(relief, rest.xyz * 79.0);
  vec3 albedo = base_colour * base_colour;
  albedo *= (0.50 + 0.62 * coarse.r) * (0.66 + 0.60 * fine.a);
  albedo = mix(albedo, vec3(0.50, 0.25, 0.20), 0.28 * smoothstep(0.50, 0.9, coarse.g));
  albedo = mix(albedo, vec3(0.09, 0.007, 0.009), 0.85 * smoothstep(0.50, 0.85, coarse.a));
#ifdef REGIONS
  albedo = tissue_at(rest.xyz, albedo, smoothstep(0.30, 0.80, coarse.r), 0.68 + 0.54 * fine.a);
  float openness = 0.70 + 0.30 * exp2(-60.0 * depth);
#elif defined(LAYERS)
  albedo = layer_at(depth + 0.0008 * (coarse.b - 0.5)) * (0.66 + 0.5 * coarse.r) * (0.70 + 0.54 * fine.a);
  float openness = 0.55 + 0.45 * exp2(-110.0 * depth);
#else
  float low = depth + 0.004 * (coarse.r - 0.5);
  albedo = mix(albedo, vec3(0.15, 0.010, 0.010), 0.75 * smoothstep(0.001, 0.010, low));
  // A capsule thinner than a pixel would flicker: it is drawn as wide as a pixel, and fainter.
  float pixel = fwidth(depth);
  float lip = 1.0 - smoothstep(0.00010, 0.0005 + pixel, depth + 0.0003 * (coarse.b - 0.5));
  lip *= 0.0005 / (0.0005 + pixel);
  albedo = mix(albedo, vec3(0.55, 0.33, 0.28), lip);
  float openness = 0.36 + 0.64 * exp2(-170.0 * depth);
#endif
  vec3 film = bumped(n, 0.34 * (fine.rgb - 0.5));
  emit_tissue(mix(n, film, 0.7), film, albedo * wet_shade(), openness, 1.0 + wet_gloss());
})";

// A film on the lips of cuts.
constexpr const char* kBlood = R"(
void main() {
#ifdef SECTION
  if (dot(section, vec4(p_view, 1.0)) > 0.0) discard;
#endif
  vec3 n = normalize(n_view);
  float key = mix(0.25, 1.0, key_light_at(p_view));
  emit(base_colour * base_colour * (key * max(dot(n, kKey), 0.0) + 0.25 * max(dot(n, kFill), 0.0) + 0.22));
})";

// Colours that say a value: the light only models the form.
constexpr const char* kScalarField = R"(
uniform vec3 colour_stops[5];
void main() {
#ifdef SECTION
  if (drawn_as_section()) return;
#endif
  vec3 n = normalize(n_view);
  if (!gl_FrontFacing) n = -n;
  float at = 4.0 * clamp(scalar, 0.0, 1.0);
  int stop = min(int(at), 3);
  vec3 colour = mix(colour_stops[stop], colour_stops[stop + 1], at - float(stop));
  float light = 0.72 + 0.28 * max(dot(n, kKey), 0.0);
  fragment = vec4(colour * light, 1.0);
})";

constexpr const char* kMetal = R"(
void main() {
  vec3 n = normalize(n_view);
  vec3 v = normalize(-p_view);
  float brush = texture(noise, vec3(rest.xy * 130.0, rest.z * 9.0)).b;
  vec3 film = normalize(n + 0.06 * (brush - 0.5));
  vec3 mirror = reflect(-v, film);
  vec3 f0 = base_colour * base_colour;
  vec3 fresnel = f0 + (1.0 - f0) * exp2(-8.0 * max(dot(film, v), 0.0));
  // Steel shows its surroundings: some dark and bright bands make it read as metal.
  float band = 0.5 + 0.5 * sin(5.0 * mirror.x + 3.5 * mirror.y + 0.6);
  vec3 light = surroundings(mirror) * 0.8 + mix(vec3(0.05), vec3(0.62, 0.63, 0.66), band * band);
  light += 0.9 * lobe(dot(mirror, kKey), 30.0);
  emit(fresnel * light + 0.05 * f0);
})";

constexpr const char* kPolymer = R"(
void main() {
  vec3 n = normalize(n_view);
  vec3 v = normalize(-p_view);
  vec3 mirror = reflect(-v, n);
  vec3 albedo = base_colour * base_colour;
  vec3 light = albedo * (1.4 * max(dot(n, kKey), 0.0) + 0.4 * max(dot(n, kFill), 0.0) + 0.25);
  light += (0.03 + 0.4 * exp2(-8.0 * max(dot(n, v), 0.0))) * surroundings(mirror) * 0.6;
  emit(light + 0.12 * lobe(dot(mirror, kKey), 50.0));
})";

// Bodies of other matter than tissue.
constexpr const char* kPlastic = R"(
void main() {
  vec3 n = normalize(n_view);
  if (!gl_FrontFacing) n = -n;
  vec3 v = normalize(-p_view);
  float key = key_light_at(p_view);
  vec3 mirror = reflect(-v, n);
  vec3 albedo = base_colour * base_colour;
  vec3 light = albedo * (1.1 * key * max(dot(n, kKey), 0.0) + 0.35 * max(dot(n, kFill), 0.0) + 0.22);
  light += (0.03 + 0.3 * exp2(-8.0 * max(dot(n, v), 0.0))) * surroundings(mirror) * 0.5 * mix(0.3, 1.0, key);
  emit(light + 0.15 * key * lobe(dot(mirror, kKey), 60.0));
})";

constexpr const char* kCloth = R"(
void main() {
  vec3 n = normalize(n_view);
  if (!gl_FrontFacing) n = -n;
  vec4 folds = texture(noise, rest.xyz * 5.0 + 0.21);
  vec4 weave = texture(relief, rest.xyz * 150.0);
  vec3 albedo = base_colour * base_colour * (0.86 + 0.22 * folds.r) * (0.88 + 0.20 * weave.a);
  float key = mix(0.25, 1.0, key_light_at(p_view));
  emit(albedo * (key * max(dot(n, kKey), 0.0) + 0.25 * max(dot(n, kFill), 0.0) + 0.22));
})";

constexpr const char* kGlow = R"(
void main() {
  float facing = max(dot(normalize(n_view), normalize(-p_view)), 0.0);
  vec3 hot = base_colour * base_colour;
  emit(mix(hot * 0.9, hot * 2.2 + vec3(1.2, 0.9, 0.5), facing * facing));
})";

// The background as shown on the screen, by place in the picture, -1 to 1.
constexpr const char* kBackdrop = R"(
vec3 backdrop(vec2 screen) {
  vec2 d = screen * vec2(0.62, 0.55) - vec2(-0.06, 0.18);
  float light = max(1.0 - dot(d, d), 0.0);
  return mix(vec3(0.085, 0.10, 0.115), vec3(0.36, 0.40, 0.43), light * light);
}
)";

// Surgical cloth: folds, the shade of the bodies on it, and a weave. Far from the middle it passes into the backdrop:
// rest_depth.z is the share of the backdrop, in thousandths. It is flat and fills a picture, so all but the weave and
// the shadows of instruments is computed at its vertices, as colours on the screen.
constexpr const char* kDrapeVertex = R"(
uniform vec3 base_colour;
out vec2 place;
out vec3 lit;
out vec3 shadowed;
out vec3 woven;
void main() {
  put_vertex();
  place = rest_depth.xy;
  vec3 n = normalize(mat3(view_from_mesh) * normal);
  vec3 albedo = base_colour * base_colour * (0.86 + 0.22 * vertex_pattern.r) * (1.0 - rest_depth.w);
  float lamp = max(dot(n, kKey), 0.0), rest = 0.25 * max(dot(n, kFill), 0.0) + 0.22;
  float share = 1000.0 * rest_depth.z;
  vec3 behind = share * backdrop(gl_Position.xy / max(gl_Position.w, 1e-6));
  woven = (1.0 - share) * shown(albedo * (lamp + rest));
  lit = woven + behind;
  shadowed = (1.0 - share) * shown(albedo * (0.35 * lamp + rest)) + behind;
})";
constexpr const char* kDrape = R"(
in vec2 place;
in vec3 lit;
in vec3 shadowed;
in vec3 woven;
uniform sampler2D weave;  // a plane of the relief's mottling
void main() {
  vec3 colour = lit;
#ifdef SHADOWS
  colour = mix(shadowed, lit, key_light_at(p_view));
#endif
  fragment = vec4(colour + woven * (0.11 * texture(weave, place * 150.0).r - 0.066), 1.0);
})";

// A triangle over the whole picture, at the far plane.
constexpr const char* kBackgroundVertex = R"(
out vec2 screen;
void main() {
  screen = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(screen, 1.0, 1.0);
})";

constexpr const char* kBackground = R"(
in vec2 screen;
out vec4 fragment;
void main() {
  vec3 c = backdrop(screen);
  // Half a grey level of fixed grain prevents bands.
  float grain = fract(dot(gl_FragCoord.xy, vec2(0.7548777, 0.5698403))) - 0.5;
  fragment = vec4(c + grain / 255.0, 1.0);
})";

// Wireframe: corners carry their distance to the opposite edge in pixels. Baerentzen et al. 2008.
constexpr const char* kWireGeometry = R"(
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;
uniform vec2 half_size_px;
invariant gl_Position;
noperspective out vec3 edge_px;
void main() {
  vec2 p[3];
  for (int i = 0; i < 3; ++i) {
    if (gl_in[i].gl_Position.w <= 0.0) return;
    p[i] = gl_in[i].gl_Position.xy / gl_in[i].gl_Position.w * half_size_px;
  }
  vec2 a = p[2] - p[1], b = p[0] - p[2], c = p[1] - p[0];
  float area = abs(a.x * b.y - a.y * b.x);
  vec3 height = area / max(vec3(length(a), length(b), length(c)), vec3(1e-6));
  for (int i = 0; i < 3; ++i) {
    edge_px = vec3(0.0);
    edge_px[i] = height[i];
    gl_Position = gl_in[i].gl_Position;
    EmitVertex();
  }
  EndPrimitive();
})";

constexpr const char* kWire = R"(
noperspective in vec3 edge_px;
out vec4 fragment;
void main() {
  float nearest = min(edge_px.x, min(edge_px.y, edge_px.z));
  float line = 0.75 * (1.0 - smoothstep(0.4, 1.2, nearest));
  if (line < 0.02) discard;
  fragment = vec4(0.02, 0.03, 0.05, line);
})";

// The same where wireframes are lines.
constexpr const char* kWireLine = R"(
out vec4 fragment;
void main() { fragment = vec4(0.02, 0.03, 0.05, 0.6); })";

}  // namespace sectio::shaders
