# Part of the layer servo, in a folder of its own.
set(adaptive_sources adaptive_servo.cpp steering.cpp)
set(adaptive_headers adaptive_servo.h steering.h)
set(adaptive_tests adaptive_servo_test.cpp learnt_state_test.cpp steering_test.cpp)
foreach(list adaptive_sources adaptive_headers adaptive_tests)
  list(TRANSFORM ${list} PREPEND adaptive/)
endforeach()
