// A robot with wheel encoders on interrupts and a tag detector on Serial1; its pose comes out on Serial.
// For boards with a floating-point unit and 22 KB of RAM to spare: Portenta H7, Nano 33 BLE, Teensy 4,
// ESP32-S3; others with fewer beacons and steps (examples/arduino/README.md).
#include <bslam.h>

// Your robot: pins of each encoder's two channels, and its measures (docs/TUNING.md says how to find them).
// Those of an ESP32 are no flash, console, USB, or level that is read at the start; its Serial1 listens on
// DETECTOR_RX.
#if CONFIG_IDF_TARGET_ESP32C3 || CONFIG_IDF_TARGET_ESP32C6
const int LEFT_A = 0, LEFT_B = 1, RIGHT_A = 3, RIGHT_B = 6, DETECTOR_RX = 7;
#elif defined ESP32  // the first one, S2, S3
const int LEFT_A = 4, LEFT_B = 13, RIGHT_A = 14, RIGHT_B = 18, DETECTOR_RX = 21;
#else
const int LEFT_A = 2, LEFT_B = 4, RIGHT_A = 3, RIGHT_B = 5;
#define IRAM_ATTR  // of an ESP32: code of interrupts, which must not wait for flash
#endif
constexpr float WHEELBASE_M = 0.2f, WHEEL_RADIUS_M = 0.033f, CAMERA_AHEAD_M = 0.05f;
const int TICKS_PER_REVOLUTION = 1440;  // edges of channel A in a turn of the wheel
const int64_t STEP_US = 40000;
static_assert(WHEELBASE_M >= 0.02f && WHEELBASE_M <= 2, "WHEELBASE_M: 0.02 to 2, in metres");
static_assert(WHEEL_RADIUS_M >= 0.005f && WHEEL_RADIUS_M <= 0.5f, "WHEEL_RADIUS_M: 0.005 to 0.5, in metres");
static_assert(CAMERA_AHEAD_M >= -1 && CAMERA_AHEAD_M <= 1, "CAMERA_AHEAD_M: -1 to 1, in metres");

static bslam_t robot;                // all the memory that the filter has
static unsigned refused = 0;         // lines, sightings and readings that were not taken
static const char *reason = "none";  // of the last
static volatile uint32_t left_ticks = 0, right_ticks = 0;

static void IRAM_ATTR left_edge() {
  left_ticks += digitalRead(LEFT_A) == digitalRead(LEFT_B) ? -1 : 1;
}

static void IRAM_ATTR right_edge() {
  right_ticks += digitalRead(RIGHT_A) == digitalRead(RIGHT_B) ? -1 : 1;
}

/// micros() begins again after 71 minutes; this does not.
static int64_t now_us() {
  static int64_t now = 0;
  return now += (uint32_t)(micros() - (uint32_t)now);
}

/// Counts what is refused, and keeps why.
static void check(bool is_taken, const char *why) {
  refused += !is_taken;
  reason = is_taken ? reason : why;
}

void setup() {
  Serial.begin(115200);
#ifdef ESP32
  Serial1.begin(115200, SERIAL_8N1, DETECTOR_RX);
#else
  Serial1.begin(115200);
#endif
  const int pins[] = {LEFT_A, LEFT_B, RIGHT_A, RIGHT_B};
  for (int pin : pins) {
    pinMode(pin, INPUT_PULLUP);
  }
  attachInterrupt(digitalPinToInterrupt(LEFT_A), left_edge, CHANGE);
  attachInterrupt(digitalPinToInterrupt(RIGHT_A), right_edge, CHANGE);

  bslam_settings_t settings;
  int bad_setting = -1;
  bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
  settings.wheelbase_m = WHEELBASE_M;
  settings.left_radius_m = settings.right_radius_m = WHEEL_RADIUS_M;
  settings.ticks_per_revolution = TICKS_PER_REVOLUTION;
  settings.counter_bits = 32;
  settings.mount_x_m = CAMERA_AHEAD_M;
  for (bslam_status_t status; (status = bslam_init(&robot, &settings, &bad_setting)) != BSLAM_OK;) {
    Serial.println(bslam_status_name(status));  // of a setting, or BSLAM_E_SIZE
    Serial.println(status == BSLAM_E_PARAMETER ? bslam_settings_info(bad_setting)->name
                                               : "README: Sizes");
    delay(1000);
  }
}

/// "AGE_MS TAG BEARING_MRAD RANGE_MM": a tag, left positive. It counts from when the picture was taken.
static void take_sighting(const char *line) {
  int age_ms = 0, tag = 0, mrad = 0, mm = 0;
  char more;
  const int numbers = sscanf(line, "%d %d %d %d %c", &age_ms, &tag, &mrad, &mm, &more);
  if (numbers != 4) {  // EOF: a blank line, which is nothing
    check(numbers == EOF, "not four whole numbers");
    return;
  }
  bslam_sighting_t seen = {};
  seen.label = tag;
  seen.bearing_rad = 1e-3f * mrad;
  seen.range_m = 1e-3f * mm;
  seen.has_range = true;
  const bslam_status_t status = bslam_sightings(&robot, now_us() - 1000LL * age_ms, &seen, 1);
  check(status == BSLAM_OK, bslam_status_name(status));
}

static void listen_to_detector() {
  static char line[64];
  static size_t length = 0;
  while (Serial1.available() > 0) {
    const char byte = Serial1.read();
    if (byte == '\n') {
      line[length] = '\0';
      take_sighting(length < sizeof line - 1 ? line : "too long");  // and noise
      length = 0;
    } else if (length < sizeof line - 1) {
      line[length++] = byte;
    }
  }
}

void loop() {
  static int64_t step_us = 0, steps = 0;
  listen_to_detector();
  if (now_us() - step_us < STEP_US) {
    return;
  }
  bslam_odometry_reading_t wheels = {};
  noInterrupts();
  wheels.left_ticks = left_ticks;
  wheels.right_ticks = right_ticks;
  interrupts();
  wheels.time_us = step_us = now_us();
  wheels.source = BSLAM_ODOMETRY_TICKS;
  const bslam_status_t status = bslam_odometry(&robot, &wheels);
  check(status == BSLAM_OK, bslam_status_name(status));

  const bslam_pose_t pose = bslam_pose(&robot);  // what your robot steers by
  char text[128];
  snprintf(text, sizeof text, "%d mm, %d mm, %d mrad, %d beacons, %u refused (last: %s)",
           (int)(1e3f * pose.x_m), (int)(1e3f * pose.y_m), (int)(1e3f * pose.theta_rad),
           (int)bslam_health(&robot).beacons, refused, reason);
  Serial.println(text);
  bslam_beacon_view_t tag;  // one of the map, at each step another
  if (bslam_beacon(&robot, (int)(steps++ % BSLAM_BEACONS_MAX), &tag) == BSLAM_OK) {
    const int x_mm = (int)(1e3f * tag.x_m), y_mm = (int)(1e3f * tag.y_m);
    snprintf(text, sizeof text, "tag %d at %d mm, %d mm", (int)tag.label, x_mm, y_mm);
    Serial.println(text);
  }
}
