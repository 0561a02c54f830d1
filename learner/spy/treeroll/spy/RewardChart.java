package treeroll.spy;

import info.monitorenter.gui.chart.Chart2D;
import info.monitorenter.gui.chart.IAxis.AxisTitle;
import info.monitorenter.gui.chart.ITrace2D;
import info.monitorenter.gui.chart.traces.Trace2DSimple;
import java.awt.BasicStroke;
import java.awt.BorderLayout;
import java.awt.Color;
import java.awt.Component;
import java.awt.FlowLayout;
import java.util.HashMap;
import java.util.LinkedHashMap;
import java.util.Map;
import javax.swing.DefaultListCellRenderer;
import javax.swing.JComboBox;
import javax.swing.JLabel;
import javax.swing.JList;
import javax.swing.JPanel;
import treeroll.run_status_t;

/** A line for each run, coloured by condition, and what the colours mean. In Swing's thread. */
final class RewardChart extends JPanel {
  private static final String ALL = "all conditions";
  private static final int NAMES_MAX = 20; // in the legend
  private static final BasicStroke STROKE = new BasicStroke(1.5f);
  /** Told apart by those who see no red or no green, too (Okabe and Ito). */
  static final Color[] COLOURS = {
    new Color(0x0072B2), new Color(0xD55E00), new Color(0x009E73), new Color(0xCC79A7),
    new Color(0xE69F00), new Color(0x56B4E9), new Color(0x000000)
  };

  /** How much of a run is drawn. An unknown reward is no point of the line. */
  private static final class Line {
    final ITrace2D trace = new Trace2DSimple();
    int drawn = 0;
  }

  private final StudyHistory history = new StudyHistory();
  private final Chart2D chart = new Chart2D();
  private final Map<StudyHistory.RunName, Line> lines = new HashMap<>();
  private final JComboBox<RunHistory.Measure> measure =
      new JComboBox<>(RunHistory.Measure.values());
  private final JComboBox<Object> shown = new JComboBox<>(new Object[] {ALL});
  private final JPanel legend = new JPanel(new FlowLayout(FlowLayout.LEFT));
  private final Map<StudyHistory.Group, Color> inLegend = new LinkedHashMap<>();
  private boolean saysOverflow = false;

  RewardChart() {
    super(new BorderLayout());
    chart.setPaintLabels(false); // one for each run would be thousands
    chart.getAxisX().setAxisTitle(new AxisTitle("roll-outs applied"));
    chart.getAxisY().setAxisTitle(new AxisTitle("reward"));
    chart.getAxisY().setPaintGrid(true);
    JPanel choices = new JPanel(new FlowLayout(FlowLayout.LEFT));
    choices.add(measure);
    shown.setRenderer(new GroupNames());
    choices.add(shown);
    add(choices, BorderLayout.NORTH);
    add(chart, BorderLayout.CENTER);
    add(legend, BorderLayout.SOUTH);
    measure.addActionListener(event -> drawAll());
    shown.addActionListener(event -> drawAll());
  }

  void take(run_status_t status) {
    StudyHistory.News news = history.take(status);
    if (inLegend.size() < history.groups().size() || history.overflows() != saysOverflow) {
      writeLegend();
    }
    switch (news) {
      case NOTHING -> {}
      case A_POINT -> draw(new StudyHistory.RunName(status.learner_id, status.run));
      case ALL -> drawAll();
    }
  }

  /** Conditions as they are called now: another learner gives all of them longer names. */
  private final class GroupNames extends DefaultListCellRenderer {
    @Override
    public Component getListCellRendererComponent(
        JList<?> list, Object value, int index, boolean isSelected, boolean hasFocus) {
      Object words = value instanceof StudyHistory.Group group ? history.nameOf(group) : value;
      return super.getListCellRendererComponent(list, words, index, isSelected, hasFocus);
    }
  }

  private boolean isShown(StudyHistory.Group group) {
    Object chosen = shown.getSelectedItem();
    return chosen == null || chosen.equals(ALL) || chosen.equals(group);
  }

  /** Its new point; all of them where it has none of the earlier ones, or fewer. */
  private void draw(StudyHistory.RunName name) {
    StudyHistory.Group group = history.groupOf(name);
    if (!isShown(group)) return;
    RunHistory run = history.runs().get(name);
    RunHistory.Measure measured = (RunHistory.Measure) measure.getSelectedItem();
    Line line = lines.get(name);
    if (line != null && line.drawn != run.size() - 1) {
      if (!line.trace.isEmpty()) chart.removeTrace(line.trace);
      line = null;
    }
    if (line == null) {
      line = new Line();
      line.trace.setColor(inLegend.get(group));
      line.trace.setStroke(STROKE);
      lines.put(name, line);
    }
    for (; line.drawn < run.size(); ++line.drawn) {
      double reward = run.rewardAt(line.drawn, measured);
      if (Double.isNaN(reward)) continue; // as the first point it would spoil the axis' scale
      if (line.trace.isEmpty()) chart.addTrace(line.trace);
      line.trace.addPoint(run.rolloutsAt(line.drawn), reward);
    }
  }

  private void drawAll() {
    chart.removeAllTraces();
    lines.clear();
    for (StudyHistory.RunName name : history.runs().keySet()) {
      if (history.runs().get(name).size() > 0) draw(name);
    }
  }

  private void writeLegend() {
    for (StudyHistory.Group group : history.groups()) {
      if (inLegend.containsKey(group)) continue;
      inLegend.put(group, COLOURS[inLegend.size() % COLOURS.length]);
      shown.addItem(group);
    }
    saysOverflow = history.overflows();
    legend.removeAll();
    inLegend.entrySet().stream()
        .limit(NAMES_MAX)
        .forEach(
            entry -> {
              JLabel label = new JLabel("\u2014 " + history.nameOf(entry.getKey()));
              label.setForeground(entry.getValue());
              legend.add(label);
            });
    if (inLegend.size() > NAMES_MAX) legend.add(new JLabel("\u2026"));
    if (saysOverflow) legend.add(new JLabel("more runs speak than are drawn"));
    legend.revalidate();
    legend.repaint();
    shown.repaint();
  }
}
