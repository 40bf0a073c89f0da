// A viewer on another vendor's DDS (Cyclone DDS), written from docs/wire.md and idl/ alone: it joins a session, pulls
// the keyframe of each body, follows the deltas until the session ends, and compares its own hashes with the server's.
// usage: cyclone_viewer DOMAIN SESSION VERSION_OF_THE_WIRE
#include <dds/dds.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "configuration.h"
#include "session.h"
#include "state.h"
#include "topology.h"

enum {
  kMostBodies = 256,
  kMostTaken = 64,
  kWindowChunks = 16,
  kKeyframeHeaderBytes = 40,
  kVertexBytes = 25,
  kTriangleBytes = 13,
  kVerticesOfPiece = 192,
  kDeltasToTell = 50,
};
static const uint64_t kNoRevision = UINT64_MAX;
static const uint32_t kFree = UINT32_MAX;
static const dds_duration_t kPatience = DDS_SECS(60);
static const dds_duration_t kPullAgain = DDS_SECS(2);

typedef struct {
  sectio_wire_VertexEdit* vertices;  // one a slot
  sectio_wire_Triangle* triangles;
  uint32_t vertex_slots, triangle_slots;
  uint64_t revision, hash;
  bool is_known;

  uint8_t* keyframe;  // while it is pulled
  uint64_t keyframe_revision;
  uint32_t chunks, first_chunk, chunks_of_window;
  uint64_t chunks_got;  // of the window, one bit each
  dds_time_t asked;
} Body;

static struct {
  dds_entity_t participant, waitset;
  dds_entity_t programs, scenes, deltas, keyframes, states, pieces, events, status, ends, requests;
  uint64_t epoch;
  uint32_t bodies_count;
  Body bodies[kMostBodies];
  uint64_t deltas_count, states_count, pieces_count, events_count, status_count, status_compared, last_step;
  bool has_end;
  sectio_wire_SessionEnd end;
} session;

static _Noreturn void fail(const char* text, uint64_t number) {
  printf("cyclone_viewer: error: %s (%llu)\n", text, (unsigned long long)number);
  exit(1);
}

static dds_entity_t made(dds_entity_t entity, const char* what) {
  if (entity < 0) fail(what, (uint64_t)-entity);
  return entity;
}

static void* room(void* memory, size_t count, size_t size) {
  memory = realloc(memory, count * size);
  if (memory == NULL && count > 0) fail("no memory", count);
  return memory;
}

// The hash of a mesh: docs/wire.md.
static uint64_t mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

static uint64_t combine(uint64_t hash, uint64_t value) {
  return mix(hash ^ mix(value));
}

static uint64_t hash_of_vertex(const sectio_wire_VertexEdit* vertex) {
  if (!vertex->alive) return 0;
  uint64_t hash = mix(0x7665727465780000u + vertex->slot);
  for (int i = 0; i < 3; ++i) {
    uint64_t bits;
    memcpy(&bits, &vertex->rest_body_m[i], sizeof bits);
    hash = combine(hash, bits);
  }
  return hash;
}

static uint64_t hash_of_triangle(uint32_t slot, const sectio_wire_Triangle* triangle) {
  if (triangle->corners[0] == kFree) return 0;
  uint64_t hash = mix(0x747269616e000000u + slot);
  for (int i = 0; i < 3; ++i) hash = combine(hash, triangle->corners[i]);
  return combine(hash, triangle->surface);
}

static uint64_t hash_of_slots(const Body* body) {
  return combine(mix(body->vertex_slots), body->triangle_slots);
}

static void set_vertex(Body* body, const sectio_wire_VertexEdit* edit) {
  sectio_wire_VertexEdit* vertex = &body->vertices[edit->slot];
  body->hash += hash_of_vertex(edit) - hash_of_vertex(vertex);
  *vertex = *edit;
}

static void set_triangle(Body* body, uint32_t slot, const sectio_wire_Triangle* triangle) {
  body->hash += hash_of_triangle(slot, triangle) - hash_of_triangle(slot, &body->triangles[slot]);
  body->triangles[slot] = *triangle;
}

// Makes room for slots, and frees the new ones; fewer slots are as many as before until keep_slots().
static void add_slots(Body* body, uint32_t vertex_slots, uint32_t triangle_slots) {
  if (vertex_slots > body->vertex_slots) body->vertices = room(body->vertices, vertex_slots, sizeof body->vertices[0]);
  if (triangle_slots > body->triangle_slots)
    body->triangles = room(body->triangles, triangle_slots, sizeof body->triangles[0]);
  for (uint32_t v = body->vertex_slots; v < vertex_slots; ++v)
    body->vertices[v] = (sectio_wire_VertexEdit){v, false, {0, 0, 0}};
  for (uint32_t t = body->triangle_slots; t < triangle_slots; ++t)
    body->triangles[t] = (sectio_wire_Triangle){{kFree, kFree, kFree}, 0};
}

static void keep_slots(Body* body, uint32_t vertex_slots, uint32_t triangle_slots) {
  body->hash -= hash_of_slots(body);
  body->vertex_slots = vertex_slots;
  body->triangle_slots = triangle_slots;
  body->hash += hash_of_slots(body);
}

static void apply(Body* body, const sectio_wire_TopologyDelta* delta) {
  if (delta->revision <= body->revision) return;  // the keyframe has it
  if (delta->base_revision != body->revision) fail("a delta was lost before revision", delta->revision);
  add_slots(body, delta->vertex_slots_after, delta->triangle_slots_after);
  for (uint32_t i = 0; i < delta->vertices._length; ++i) set_vertex(body, &delta->vertices._buffer[i]);
  for (uint32_t i = 0; i < delta->triangles._length; ++i)
    set_triangle(body, delta->triangles._buffer[i].slot, &delta->triangles._buffer[i].triangle);
  keep_slots(body, delta->vertex_slots_after, delta->triangle_slots_after);
  body->revision = delta->revision;
  if (body->hash != delta->hash_after) fail("another hash after the delta of revision", delta->revision);
}

static const uint8_t* get(void* value, const uint8_t* bytes, size_t size) {
  memcpy(value, bytes, size);  // little-endian, as this machine is
  return bytes + size;
}

static void read_keyframe(Body* body, uint64_t total_bytes) {
  uint32_t head[4];
  uint64_t revision, hash, permanent_hash;
  const uint8_t* at = get(head, body->keyframe, sizeof head);
  at = get(&revision, at, sizeof revision);
  at = get(&hash, at, sizeof hash);
  at = get(&permanent_hash, at, sizeof permanent_hash);
  const uint32_t vertex_slots = head[2], triangle_slots = head[3];
  if (total_bytes !=
      kKeyframeHeaderBytes + (uint64_t)vertex_slots * kVertexBytes + (uint64_t)triangle_slots * kTriangleBytes)
    fail("a keyframe of another size", total_bytes);
  add_slots(body, vertex_slots, triangle_slots);
  body->hash = hash_of_slots(body);  // of no slots
  for (uint32_t v = 0; v < vertex_slots; ++v) {
    sectio_wire_VertexEdit vertex = {v, *at++ == 1, {0, 0, 0}};
    at = get(vertex.rest_body_m, at, sizeof vertex.rest_body_m);
    set_vertex(body, &vertex);
  }
  for (uint32_t t = 0; t < triangle_slots; ++t) {
    sectio_wire_Triangle triangle;
    at = get(triangle.corners, at, sizeof triangle.corners);
    triangle.surface = *at++;
    set_triangle(body, t, &triangle);
  }
  keep_slots(body, vertex_slots, triangle_slots);
  if (body->hash != hash) fail("another hash than that of the keyframe of revision", revision);
  body->revision = revision;
  body->is_known = true;
  free(body->keyframe);
  body->keyframe = NULL;
}

static void ask(uint32_t body_id, uint64_t revision, uint32_t first_chunk) {
  Body* body = &session.bodies[body_id];
  sectio_wire_KeyframeRequest request = {.epoch = session.epoch,
                                         .body_id = body_id,
                                         .known_revision = kNoRevision,
                                         .client = 1,
                                         .revision = revision,
                                         .first_chunk = first_chunk,
                                         .chunks = kWindowChunks};
  body->first_chunk = first_chunk;
  body->chunks_got = 0;
  body->asked = dds_time();
  if (dds_write(session.requests, &request) < 0) fail("no request can be written for body", body_id);
}

static void pull_unknown_bodies(void) {
  for (uint32_t b = 0; b < session.bodies_count; ++b) {
    Body* body = &session.bodies[b];
    if (body->is_known || dds_time() - body->asked < kPullAgain) continue;
    free(body->keyframe);
    body->keyframe = NULL;
    ask(b, kNoRevision, 0);
  }
}

static void hear_scene(const sectio_wire_SceneInfo* scene) {
  if (session.epoch != 0 && scene->epoch != session.epoch) return;
  session.epoch = scene->epoch;
  for (uint32_t b = session.bodies_count; b < scene->bodies._length && b < kMostBodies; ++b)
    printf("body %u: %s\n", b, scene->bodies._buffer[b].name);
  session.bodies_count = scene->bodies._length;
}

static void hear_chunk(const sectio_wire_KeyframeChunk* chunk) {
  if (chunk->epoch != session.epoch || chunk->body_id >= session.bodies_count) return;
  Body* body = &session.bodies[chunk->body_id];
  if (body->is_known) return;
  if (body->keyframe == NULL) {
    body->keyframe = room(NULL, chunk->total_bytes, 1);
    body->keyframe_revision = chunk->revision;
    body->chunks = chunk->chunks;
  }
  if (chunk->revision != body->keyframe_revision) return;  // somebody else pulls it
  if (chunk->chunk < body->first_chunk || chunk->chunk >= body->first_chunk + kWindowChunks) return;
  // All chunks but the last are of one size.
  const bool is_last = chunk->chunk + 1 == chunk->chunks;
  const uint64_t at =
      is_last ? chunk->total_bytes - chunk->bytes._length : (uint64_t)chunk->chunk * chunk->bytes._length;
  if (at + chunk->bytes._length > chunk->total_bytes) fail("a chunk beyond its keyframe", chunk->chunk);
  memcpy(body->keyframe + at, chunk->bytes._buffer, chunk->bytes._length);
  body->chunks_got |= 1u << (chunk->chunk - body->first_chunk);
  const uint32_t left = body->chunks - body->first_chunk;
  const uint32_t wanted = left < kWindowChunks ? left : kWindowChunks;
  if (body->chunks_got != (1u << wanted) - 1) return;
  if (wanted == left)
    read_keyframe(body, chunk->total_bytes);
  else
    ask(chunk->body_id, body->keyframe_revision, body->first_chunk + kWindowChunks);
}

static void hear_delta(const sectio_wire_DeltaMessage* message) {
  if (message->epoch != session.epoch) return;
  if (message->body_id >= session.bodies_count) fail("a delta of an unknown body", message->body_id);
  apply(&session.bodies[message->body_id], &message->delta);
  if (++session.deltas_count % kDeltasToTell == 0)
    printf("body %u: revision %llu\n", message->body_id, (unsigned long long)message->delta.revision);
}

static void hear_state(const sectio_wire_StateHeader* header) {
  if (header->epoch != session.epoch) return;
  if (header->step < session.last_step) fail("states go backwards at step", header->step);
  session.last_step = header->step;
  ++session.states_count;
  for (uint32_t b = 0; b < header->bodies._length; ++b) {
    const sectio_wire_BodyState* body = &header->bodies._buffer[b];
    const uint32_t pieces = (body->vertex_slots + kVerticesOfPiece - 1) / kVerticesOfPiece;
    if (body->pieces_sent._length != (pieces + 7) / 8) fail("a header with other pieces than its body", b);
  }
}

static void hear_piece(const sectio_wire_StatePiece* piece) {
  if (piece->epoch != session.epoch) return;
  ++session.pieces_count;
  if (piece->offsets_quanta._length % 3 != 0) fail("a piece without whole vertices", piece->piece);
  for (uint32_t i = 0; i < piece->offsets_quanta._length; ++i) {
    const double origin_quanta = piece->origin_quanta[i % 3];
    const double position_m = piece->quantum_m * (origin_quanta + piece->offsets_quanta._buffer[i]);
    if (!isfinite(position_m) || fabs(position_m) > 10) fail("a vertex out of this world in piece", piece->piece);
  }
}

static void hear_event(const sectio_wire_SessionEvent* event) {
  if (event->epoch != session.epoch) return;
  ++session.events_count;
  printf("step %llu: event of kind %u: %s\n", (unsigned long long)event->step, event->kind, event->text);
}

static void hear_status(const sectio_wire_ServerStatus* status) {
  if (status->epoch != session.epoch) return;
  ++session.status_count;
  for (uint32_t b = 0; b < status->bodies._length && b < session.bodies_count; ++b) {
    const Body* body = &session.bodies[b];
    if (!body->is_known || body->revision != status->bodies._buffer[b].revision) continue;
    ++session.status_compared;
    if (body->hash != status->bodies._buffer[b].topology_hash) fail("another hash than that of the status", b);
  }
}

static void hear_end(const sectio_wire_SessionEnd* end) {
  if (end->epoch != session.epoch || session.has_end) return;
  session.has_end = true;
  session.end.bodies._length = end->bodies._length;
  session.end.bodies._buffer = room(NULL, end->bodies._length, sizeof end->bodies._buffer[0]);
  memcpy(session.end.bodies._buffer, end->bodies._buffer, end->bodies._length * sizeof end->bodies._buffer[0]);
}

#define HEAR(reader, type, hear)                                                         \
  do {                                                                                   \
    void* samples[kMostTaken] = {NULL};                                                  \
    dds_sample_info_t infos[kMostTaken];                                                 \
    const dds_return_t count = dds_take(reader, samples, infos, kMostTaken, kMostTaken); \
    if (count < 0) fail("can't read " #type, (uint64_t)-count);                          \
    for (dds_return_t i = 0; i < count; ++i)                                             \
      if (infos[i].valid_data) hear((const type*)samples[i]);                            \
    if (count > 0) dds_return_loan(reader, samples, count);                              \
  } while (0)

// Each program announces in its user data which session it is in, and which version of the wire it speaks.
static void hear_program(const dds_builtintopic_participant_t* program) {
  void* text = NULL;
  size_t size = 0;
  if (program->qos == NULL || !dds_qget_userdata(program->qos, &text, &size)) return;
  if (size > 0) printf("a program says: %.*s\n", (int)size, (const char*)text);
  dds_free(text);
}

static bool all_known(void) {
  for (uint32_t b = 0; b < session.bodies_count; ++b)
    if (!session.bodies[b].is_known) return false;
  return session.bodies_count > 0;
}

static bool all_at_the_end(void) {
  if (!session.has_end || !all_known() || session.bodies_count != session.end.bodies._length) return false;
  for (uint32_t b = 0; b < session.bodies_count; ++b)
    if (session.bodies[b].revision < session.end.bodies._buffer[b].revision) return false;
  return true;
}

static dds_entity_t topic_of(const char* name, const dds_topic_descriptor_t* type) {
  return made(dds_create_topic(session.participant, type, name, NULL, NULL), name);
}

static dds_entity_t reader_of(dds_entity_t subscriber, const char* name, const dds_topic_descriptor_t* type,
                              dds_reliability_kind_t reliability, dds_durability_kind_t durability) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, reliability, DDS_MSECS(100));
  dds_qset_durability(qos, durability);
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  const dds_entity_t reader = made(dds_create_reader(subscriber, topic_of(name, type), qos, NULL), name);
  dds_delete_qos(qos);
  dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
  dds_waitset_attach(session.waitset, reader, 0);
  return reader;
}

static void join(dds_domainid_t domain, const char* name, const char* version) {
  made(dds_create_domain(domain, kConfiguration), "no domain");
  session.participant = made(dds_create_participant(domain, NULL, NULL), "no participant");
  session.waitset = made(dds_create_waitset(session.participant), "no waitset");

  session.programs = made(dds_create_reader(session.participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, NULL, NULL),
                          "no reader of participants");

  char partitions[4][128];
  const char* list[4];
  const char* channels[4] = {"", "/deltas", "/keyframes", "/20hz"};
  for (int i = 0; i < 4; ++i) {
    snprintf(partitions[i], sizeof partitions[i], "%s/%s%s", name, version, channels[i]);
    list[i] = partitions[i];
  }
  dds_qos_t* qos = dds_create_qos();
  dds_qset_partition(qos, 4, list);
  const dds_entity_t subscriber = made(dds_create_subscriber(session.participant, qos, NULL), "no subscriber");
  dds_qset_partition(qos, 1, list);
  const dds_entity_t publisher = made(dds_create_publisher(session.participant, qos, NULL), "no publisher");
  dds_delete_qos(qos);

  const dds_reliability_kind_t reliable = DDS_RELIABILITY_RELIABLE, best_effort = DDS_RELIABILITY_BEST_EFFORT;
  const dds_durability_kind_t now = DDS_DURABILITY_VOLATILE, late = DDS_DURABILITY_TRANSIENT_LOCAL;
  session.scenes = reader_of(subscriber, "scene", &sectio_wire_SceneInfo_desc, reliable, late);
  session.deltas = reader_of(subscriber, "topology_deltas", &sectio_wire_DeltaMessage_desc, reliable, now);
  session.keyframes = reader_of(subscriber, "keyframes", &sectio_wire_KeyframeChunk_desc, reliable, now);
  session.states = reader_of(subscriber, "state_headers", &sectio_wire_StateHeader_desc, reliable, now);
  session.pieces = reader_of(subscriber, "state_pieces", &sectio_wire_StatePiece_desc, reliable, now);
  session.events = reader_of(subscriber, "events", &sectio_wire_SessionEvent_desc, reliable, late);
  session.status = reader_of(subscriber, "server_status", &sectio_wire_ServerStatus_desc, best_effort, now);
  session.ends = reader_of(subscriber, "session_end", &sectio_wire_SessionEnd_desc, reliable, late);

  qos = dds_create_qos();
  dds_qset_reliability(qos, reliable, DDS_MSECS(100));
  dds_qset_durability(qos, late);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 64);
  session.requests =
      made(dds_create_writer(publisher, topic_of("keyframe_requests", &sectio_wire_KeyframeRequest_desc), qos, NULL),
           "no writer");
  dds_delete_qos(qos);
}

// Everything that has come. Deltas wait in their reader until all bodies are known.
static void hear(void) {
  HEAR(session.programs, dds_builtintopic_participant_t, hear_program);
  HEAR(session.scenes, sectio_wire_SceneInfo, hear_scene);
  if (session.epoch == 0) return;
  HEAR(session.keyframes, sectio_wire_KeyframeChunk, hear_chunk);
  if (all_known()) HEAR(session.deltas, sectio_wire_DeltaMessage, hear_delta);
  HEAR(session.states, sectio_wire_StateHeader, hear_state);
  HEAR(session.pieces, sectio_wire_StatePiece, hear_piece);
  HEAR(session.events, sectio_wire_SessionEvent, hear_event);
  HEAR(session.status, sectio_wire_ServerStatus, hear_status);
  HEAR(session.ends, sectio_wire_SessionEnd, hear_end);
}

int main(int count, char** arguments) {
  if (count != 4) {
    fprintf(stderr, "usage: cyclone_viewer DOMAIN SESSION VERSION_OF_THE_WIRE\n");
    return 2;
  }
  setvbuf(stdout, NULL, _IOLBF, 0);
  join((dds_domainid_t)strtoul(arguments[1], NULL, 10), arguments[2], arguments[3]);
  const dds_time_t began = dds_time();
  while (!all_at_the_end()) {
    if (dds_time() - began > kPatience) fail("the session has no end, after states", session.states_count);
    dds_waitset_wait(session.waitset, NULL, 0, DDS_MSECS(50));
    hear();
    pull_unknown_bodies();
  }
  for (uint32_t b = 0; b < session.bodies_count; ++b) {
    const Body* body = &session.bodies[b];
    printf("body %u: revision %llu, hash %016llx\n", b, (unsigned long long)body->revision,
           (unsigned long long)body->hash);
    if (body->hash != session.end.bodies._buffer[b].topology_hash) fail("another hash at the end in body", b);
  }
  printf("heard %llu deltas, %llu states, %llu pieces, %llu events, %llu status, of which %llu compared\n",
         (unsigned long long)session.deltas_count, (unsigned long long)session.states_count,
         (unsigned long long)session.pieces_count, (unsigned long long)session.events_count,
         (unsigned long long)session.status_count, (unsigned long long)session.status_compared);
  printf("equals server: yes\n");
  dds_delete(session.participant);
  return 0;
}
