#include "sim_server/commands/commands.h"

int main(int argc, char** argv) {
  using namespace sectio;
  return run_program("sim_server", [&] {
    Arguments program("sim_server",
                      "Owns the bodies of a scene and cuts them: a session on the network, or --offline.");
    const Arguments::Action run = run_command(program);
    program.command("replay",
                    "rebuilds the bodies of a session from its journal, with their hashes; ends with 3 when it "
                    "differs or is damaged",
                    replay_command);
    program.command("play", "a recorded session again, for viewers; ends with 3 when it differs or is damaged",
                    play_command);
    program.command("mesh", "fills a closed surface with tetrahedra and reports their quality", mesh_command);
    program.command("organ", "makes a body and a scene around the triangles of any file", organ_command);
    program.command("plan", "the models that the bodies with model: auto get, and why", plan_command);
    program.command("gap", "how far pressing instruments are from the surface that they dent, offline", gap_command);
    program.command(
        "try", "plays a scene many times by hands that differ from its traces, and says how often it came out well",
        try_command);
    program.command("schema", "the JSON Schema of scene files, with which editors complete keys", schema_command);
    program.command("unfinished",
                    "the directory with which --resume goes on, of several of one session: STEP<tab>DIRECTORY",
                    unfinished_command);
    program.command("traces", "the trace of each tool of a scene: NUMBER<tab>FILE", traces_command);
    program.command("servers", "the servers among which a scene divides its bodies: NAME<tab>BODY,BODY",
                    servers_command);
    program.command("status", "expectation and measurement of each body of a running session", status_command);
    program.command("tilt", "tilts the patient of a running session, at the rate that the scene allows", tilt_command);
    program.command("pause", "halts a running session, until it goes on", pause_command);
    program.command("go-on", "lets a paused session go on", go_on_command);
    program.command("freeze", "holds an instrument of a running session off its hand: it stays where it is",
                    freeze_command);
    program.command("thaw", "lets a frozen instrument follow its hand again", thaw_command);
    program.command("speed", "lets a running session run faster or slower than the clock", speed_command);
    program.command("anew", "begins a running session anew; the try so far keeps its files", anew_command);
    program.command("seek", "moves a shown record, or a live session with --export, to another time", seek_command);
    program.command("score", "the score of the exercise of a running session, so far", score_command);
    return program.run(argc, argv, run);
  });
}
