package treeroll.spy;

import info.monitorenter.gui.chart.Chart2D;
import info.monitorenter.gui.chart.IAxis.AxisTitle;
import info.monitorenter.gui.chart.ITrace2D;
import info.monitorenter.gui.chart.traces.Trace2DSimple;
import java.awt.BasicStroke;
import java.awt.BorderLayout;
import java.awt.Color;
import java.awt.FlowLayout;
import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import javax.swing.JComboBox;
import javax.swing.JLabel;
import javax.swing.JPanel;
import treeroll.run_status_t;

/** A line for each run, coloured by condition, and what the colours mean. In Swing's thread. */
final class RewardChart extends JPanel {
  private static final String ALL = "all conditions";
  /** Told apart by those who see no red or no green, too (Okabe and Ito). */
  static final Color[] COLOURS = {
    new Color(0x0072B2), new Color(0xD55E00), new Color(0x009E73), new Color(0xCC79A7),
    new Color(0xE69F00), new Color(0x56B4E9), new Color(0x000000)
  };

  private final StudyHistory history = new StudyHistory();
  private final Chart2D chart = new Chart2D();
  private final Map<StudyHistory.RunName, ITrace2D> lines = new HashMap<>();
  private final JComboBox<RunHistory.Measure> measure =
      new JComboBox<>(RunHistory.Measure.values());
  private final JComboBox<String> shown = new JComboBox<>(new String[] {ALL});
  private final JPanel legend = new JPanel(new FlowLayout(FlowLayout.LEFT));
  private final List<StudyHistory.Group> inLegend = new ArrayList<>();

  RewardChart() {
    super(new BorderLayout());
    chart.setPaintLabels(false); // one for each run would be thousands
    chart.getAxisX().setAxisTitle(new AxisTitle("roll-outs applied"));
    chart.getAxisY().setAxisTitle(new AxisTitle("reward"));
    chart.getAxisY().setPaintGrid(true);
    JPanel choices = new JPanel(new FlowLayout(FlowLayout.LEFT));
    choices.add(measure);
    choices.add(shown);
    add(choices, BorderLayout.NORTH);
    add(chart, BorderLayout.CENTER);
    add(legend, BorderLayout.SOUTH);
    measure.addActionListener(event -> drawAll());
    shown.addActionListener(event -> drawAll());
  }

  void take(run_status_t status) {
    if (!history.take(status)) return;
    StudyHistory.RunName name = new StudyHistory.RunName(status.learner_id, status.run);
    if (inLegend.size() < history.groups().size()) writeLegend();
    draw(name);
  }

  private boolean isShown(StudyHistory.Group group) {
    Object chosen = shown.getSelectedItem();
    return chosen == null || chosen.equals(ALL) || chosen.equals(history.nameOf(group));
  }

  private Color colourOf(StudyHistory.Group group) {
    return COLOURS[inLegend.indexOf(group) % COLOURS.length];
  }

  /** Its new point; all of them where it has none of the earlier ones, or fewer. */
  private void draw(StudyHistory.RunName name) {
    StudyHistory.Group group = history.groupOf(name);
    if (!isShown(group)) return;
    RunHistory run = history.runs().get(name);
    RunHistory.Measure drawn = (RunHistory.Measure) measure.getSelectedItem();
    ITrace2D line = lines.get(name);
    if (line == null) {
      line = new Trace2DSimple(run.condition + " " + run.repetition);
      line.setColor(colourOf(group));
      line.setStroke(new BasicStroke(1.5f));
      lines.put(name, line);
      chart.addTrace(line);
    }
    if (line.getSize() != run.size() - 1) line.removeAllPoints();
    for (int i = line.getSize(); i < run.size(); ++i) {
      line.addPoint(run.rolloutsAt(i), run.rewardAt(i, drawn));
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
    Object chosen = shown.getSelectedItem();
    inLegend.clear();
    inLegend.addAll(history.groups());
    legend.removeAll();
    shown.removeAllItems();
    shown.addItem(ALL);
    for (StudyHistory.Group group : inLegend) {
      JLabel label = new JLabel("\u2014 " + history.nameOf(group));
      label.setForeground(colourOf(group));
      legend.add(label);
      shown.addItem(history.nameOf(group));
    }
    if (history.overflows()) legend.add(new JLabel("more runs speak than are drawn"));
    shown.setSelectedItem(chosen);
    if (shown.getSelectedItem() == null) shown.setSelectedItem(ALL);
    legend.revalidate();
    legend.repaint();
  }
}
