// Stands in for Force Dimension's library: one device with a wrist, whose state a test sets.
extern "C" {

double fake_place_m[3] = {0, 0, 0};
double fake_frame[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
double fake_gripper_rad = 0.25;
int fake_buttons = 0;
int fake_is_gone = 0;
double fake_load[6] = {0, 0, 0, 0, 0, 0};
int fake_closed = 0;

int dhdOpen() {
  return fake_is_gone ? -1 : 0;
}
int dhdClose(char) {
  fake_closed = 1;
  return 0;
}
const char* dhdErrorGetLastStr() {
  return "no device found";
}
bool dhdHasWrist(char) {
  return true;
}
bool dhdHasGripper(char) {
  return true;
}
int dhdEnableForce(unsigned char, char) {
  return 0;
}
int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double frame[3][3], char) {
  *x = fake_place_m[0];
  *y = fake_place_m[1];
  *z = fake_place_m[2];
  for (int i = 0; i < 9; ++i) (&frame[0][0])[i] = (&fake_frame[0][0])[i];
  return fake_is_gone ? -1 : 0;
}
int dhdGetGripperAngleRad(double* angle, char) {
  *angle = fake_gripper_rad;
  return 0;
}
int dhdGetButton(int index, char) {
  return fake_buttons >> index & 1;
}
int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz, double,
                                        char) {
  const double load[6] = {fx, fy, fz, tx, ty, tz};
  for (int i = 0; i < 6; ++i) fake_load[i] = load[i];
  return fake_is_gone ? -1 : 0;
}
}
