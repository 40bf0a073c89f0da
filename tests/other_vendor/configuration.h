// How the programs on Cyclone DDS find others: on this machine alone.
#pragma once

// Without key hashes Fast DDS doesn't notice that a program leaves.
static const char* kConfiguration =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>63</MaxAutoParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers>"
    "<LeaseDuration>2s</LeaseDuration></Discovery><Internal><GenerateKeyhash>true</GenerateKeyhash></Internal>"
    "</Domain></CycloneDDS>";
