# The picture in README: how four servos start and settle, from the trace of one simulated run.
#   build/ftcs simulate experiments/peers/020-g100-1s-never-step.toml --seeds 1 --trace trace.csv -q
#   gnuplot -e "trace='trace.csv'" docs/figures/lock.gp > docs/figures/lock.svg
set terminal svg size 860,360 font "sans-serif,13" background "#ffffff"
set datafile separator ','
set logscale y
set xrange [0:100]
set yrange [0.3:3e6]
set xlabel "time / s (one Sync a second)"
set ylabel "|true time error|"
set ytics ("1 ns" 1, "10 ns" 10, "100 ns" 100, "1 us" 1e3, "10 us" 1e4, "100 us" 1e5, "1 ms" 1e6) nomirror
set xtics nomirror
set border 3 lc rgb "#666666"
set grid ytics lc rgb "#e4e4e4"
set key outside right top samplen 2 spacing 1.4
servo(name) = sprintf("< grep '^%s,' %s", name, trace)
plot servo("linuxptp-pi") using 2:(abs($3)) with lines lw 1.2 lc rgb "#7b3fc4" title "linuxptp-pi", \
     servo("regression") using 2:(abs($3)) with lines lw 1.2 lc rgb "#2b8a3e" title "regression", \
     servo("ftcs") using 2:(abs($3)) with lines lw 1.2 lc rgb "#1864ab" title "ftcs", \
     servo("adaptive") using 2:(abs($3)) with lines lw 1.8 lc rgb "#d9480f" title "adaptive"
