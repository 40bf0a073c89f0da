// A program on another vendor's DDS (Cyclone DDS) that would move an instrument, and lead. It writes for three seconds,
// and says who heard it.
// usage: cyclone_writer DOMAIN SESSION VERSION_OF_THE_WIRE
#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>

#include "configuration.h"
#include "session.h"
#include "tool.h"

enum { kPackets = 3000, kNoTool = 9, kPause = 1 };

static dds_entity_t made(dds_entity_t entity, const char* what) {
  if (entity >= 0) return entity;
  printf("cyclone_writer: error: %s (%d)\n", what, (int)entity);
  exit(1);
}

static dds_entity_t writer_of(dds_entity_t participant, dds_entity_t publisher, const char* name,
                              const dds_topic_descriptor_t* type, dds_reliability_kind_t reliability) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, reliability, DDS_MSECS(100));
  if (reliability == DDS_RELIABILITY_RELIABLE) dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 16);
  const dds_entity_t topic = made(dds_create_topic(participant, type, name, NULL, NULL), name);
  const dds_entity_t writer = made(dds_create_writer(publisher, topic, qos, NULL), name);
  dds_delete_qos(qos);
  return writer;
}

static uint32_t readers_of(dds_entity_t writer) {
  dds_publication_matched_status_t status;
  made(dds_get_publication_matched_status(writer, &status), "no status");
  return status.total_count;
}

int main(int count, char** arguments) {
  if (count != 4) {
    fprintf(stderr, "usage: cyclone_writer DOMAIN SESSION VERSION_OF_THE_WIRE\n");
    return 2;
  }
  const dds_domainid_t domain = (dds_domainid_t)strtoul(arguments[1], NULL, 10);
  made(dds_create_domain(domain, kConfiguration), "no domain");
  const dds_entity_t participant = made(dds_create_participant(domain, NULL, NULL), "no participant");
  char partition[128];
  const char* list[1] = {partition};
  snprintf(partition, sizeof partition, "%s/%s", arguments[2], arguments[3]);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_partition(qos, 1, list);
  const dds_entity_t publisher = made(dds_create_publisher(participant, qos, NULL), "no publisher");
  dds_delete_qos(qos);
  const dds_entity_t packets =
      writer_of(participant, publisher, "tool_packets", &sectio_wire_ToolPacket_desc, DDS_RELIABILITY_BEST_EFFORT);
  const dds_entity_t orders =
      writer_of(participant, publisher, "session_orders", &sectio_wire_SessionOrder_desc, DDS_RELIABILITY_RELIABLE);

  sectio_wire_ToolSample sample = {.orientation_wxyz = {1, 0, 0, 0}};
  sectio_wire_ToolPacket packet = {.source = 1, .tool_id = kNoTool};
  packet.poses._length = packet.poses._maximum = 1;
  packet.poses._buffer = &sample;
  sectio_wire_SessionOrder order = {.kind = kPause, .speed_1 = 1};
  for (int i = 0; i < kPackets; ++i) {
    sample.sequence_number = (uint64_t)i + 1;
    sample.tool_time_s = 1e-3 * i;
    made(dds_write(packets, &packet), "a packet is refused");
    if (i % 500 == 0) {
      order.source = (uint64_t)i + 1;
      made(dds_write(orders, &order), "an order is refused");
    }
    dds_sleepfor(DDS_MSECS(1));
  }
  printf("readers of tool_packets: %u, of session_orders: %u\n", readers_of(packets), readers_of(orders));
  dds_delete(participant);
  return 0;
}
