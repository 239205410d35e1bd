# Part of the layer servo, in a folder of its own.
set(adaptive_sources adaptive_servo.cpp delay_shape.cpp estimator.cpp jump_watch.cpp noise_learner.cpp
  second_opinion.cpp steering.cpp)
set(adaptive_headers adaptive_servo.h change_detector.h delay_shape.h divergence_watch.h estimator.h gate.h
  evidence.h interval_meter.h jump_watch.h lanes.h lateness.h message_order.h
  model_bank.h noise_learner.h noise_model.h quick_math.h second_opinion.h sorted_window.h steering.h tick_meter.h)
set(adaptive_tests adaptive_servo_test.cpp tick_meter_test.cpp change_detector_test.cpp delay_shape_test.cpp
  divergence_watch_test.cpp gate_test.cpp
  estimator_test.cpp evidence_test.cpp input_test.cpp interval_meter_test.cpp jump_watch_test.cpp learnt_state_test.cpp model_bank_test.cpp noise_learner_test.cpp
  second_opinion_test.cpp sorted_window_test.cpp steering_test.cpp)
foreach(list adaptive_sources adaptive_headers adaptive_tests)
  list(TRANSFORM ${list} PREPEND adaptive/)
endforeach()
