// Reads a log as Foxglove and Lichtblick do, decodes every message, and prints what the test asks about as JSON.
import { readFile } from "node:fs/promises";
import { argv, stdout } from "node:process";

import { McapIndexedReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import rosmsg from "@foxglove/rosmsg";
import serialization from "@foxglove/rosmsg2-serialization";

const file = await readFile(argv[2]);
const readable = {
  size: async () => BigInt(file.length),
  read: async (offset, size) => new Uint8Array(file.subarray(Number(offset), Number(offset + size))),
};
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: await loadDecompressHandlers() });
const decoders = new Map();
const topics = {};
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  const definitions = rosmsg.parse(new TextDecoder().decode(schema.data), { ros2: true });
  decoders.set(channel.id, new serialization.MessageReader(definitions));
  topics[channel.topic] = { type: schema.name, count: 0, size: 0 };
}
const links = [];
const arrays = [];
const poses = [];
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const { topic } = reader.channelsById.get(message.channelId);
  const said = decoders.get(message.channelId).readMessage(message.data);
  topics[topic].count += 1;
  topics[topic].size += message.data.length;
  const time = Number(message.logTime);
  if (topics[topic].type === "tf2_msgs/msg/TFMessage") {
    for (const { header, child_frame_id: child, transform } of said.transforms) {
      const { translation: t, rotation: r } = transform;
      links.push({ topic, time, frame: header.frame_id, child, pose: [t.x, t.y, t.z, r.x, r.y, r.z, r.w] });
    }
  } else if (topics[topic].type === "visualization_msgs/msg/MarkerArray") {
    const markers = said.markers.map(({ header, ns, id, type, action, text, frame_locked: locked, ...rest }) => {
      const { position: p, orientation: q } = rest.pose;
      const points = Array.from(rest.points, ({ x, y, z }) => [x, y, z]);
      const pose = [p.x, p.y, p.z, q.x, q.y, q.z, q.w];
      return { frame: header.frame_id, ns, id, type, action, text, locked, pose, points, opacity: rest.color.a };
    });
    arrays.push({ topic, time, markers });
  } else if (topics[topic].type === "geometry_msgs/msg/PoseArray") {
    poses.push({ topic, time, first: said.poses[0].position, count: said.poses.length });
  }
}
stdout.write(JSON.stringify({ topics, links, arrays, poses }));
